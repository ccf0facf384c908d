"""Tunings by the program `servo-ctrl tune`: one at a time, in a process of its own, for all browsers.

The command names no bus, and nothing that a visitor enters can name one: without `--bus` the program starts
a simulator of its own, on a socket in a folder that it makes for it, or with `--controller` asks the
controller of this page for each motion. The machine file is not changed, for `--apply` is not named.
"""

import asyncio
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

from nicegui import app

from servo_ctrl.commands.local_messages import Requester
from servo_ctrl.files.tuning_files import LEAST_MS, MOST_MS
from servo_ctrl.hmi.shell.program_jobs import ENDED, Job, ProgramJobs
from servo_ctrl.hmi.shell.program_process import JobError, installed_program

PROGRAM, ARGUMENTS = "servo-ctrl", ("tune", "--progress", "json")
PLANT = "plant.toml"
"""What the simulator reads, beside the machine file."""
DIRECTORY, LOG_FILE = "tunings", "tune.jsonl"
WATCH_S = 0.25
"""Between two looks at the control right; chosen."""


class PageTunings(ProgramJobs):
    """The tunings of this process."""

    def __init__(self, directory: Path) -> None:
        super().__init__(directory / DIRECTORY, PROGRAM, LOG_FILE)
        self._watch: asyncio.Task[None] | None = None

    async def start(
        self, machine_file: Path, axis: str, ms: float, who: Requester, controller: Path | None = None
    ) -> Job:
        """Start a tuning on the simulator, or on the machine of the controller at this socket.

        The controller's log names `who`. Raises ServoCtrlError with the reason when it cannot.
        """
        if self.busy:
            raise JobError("a tuning is running already; wait for it or cancel it")
        where = () if controller is None else (f"--controller={controller}", f"--who={who.model_dump_json()}")
        place = "simulator" if controller is None else "machine"
        command = _command_for(machine_file, axis, ms, where)
        return await self.launch(
            command, [axis], who, machine_file=str(machine_file), axis=axis, ms=ms, place=place
        )

    def end_unless(self, permitted: Callable[[], bool]) -> None:
        """Cancel the running tuning as soon as its requester may no longer move the machine."""
        self._watch = asyncio.create_task(self._watched(self.running, permitted))

    async def _watched(self, job: Job | None, permitted: Callable[[], bool]) -> None:
        while job is not None and job.state not in ENDED:  # a right has no event
            if not permitted():
                await self.cancel()
            await asyncio.sleep(WATCH_S)


async def _command_for(machine_file: Path, axis: str, ms: float, where: Sequence[str]) -> list[str]:
    """Return the program with its arguments, checked before anything starts; without `where`: on hil-sim."""
    needed = [machine_file] if where else [machine_file, machine_file.with_name(PLANT)]
    for path in needed:
        if not await asyncio.to_thread(path.is_file):
            raise JobError(f"{path}: there is no such file, so nothing can be simulated")
    if not LEAST_MS <= ms <= MOST_MS:
        raise JobError(f"Ms {ms:g} is not from {LEAST_MS:g} to {MOST_MS:g}")
    # joined, so that no axis is read as an option
    options = (f"--machine={machine_file}", f"--axis={axis}", f"--ms={ms:g}")
    return [*installed_command(), *options, *where]


def installed_command() -> Sequence[str]:
    """Return the installed servo-ctrl with its first arguments. Raises JobError."""
    return (installed_program(PROGRAM), *ARGUMENTS)


@cache
def page_tunings_of(directory: Path) -> PageTunings:
    """Return the one instance for a directory."""
    tunings = PageTunings(directory)
    app.on_shutdown(tunings.cancel)
    return tunings
