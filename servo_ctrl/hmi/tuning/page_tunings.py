"""The tunings of the page's process: the same for all browsers, each action logged."""

import asyncio
from collections.abc import Callable
from functools import cache
from pathlib import Path

from nicegui import app

from servo_ctrl.commands.local_messages import Requester
from servo_ctrl.hmi.shell.logged_jobs import LoggedJobs
from servo_ctrl.hmi.shell.program_jobs import ENDED, Job
from servo_ctrl.hmi.tuning.job import TuningJobs

DIRECTORY, LOG_FILE = "tunings", "tune.jsonl"
WATCH_S = 0.25
"""Between two looks at the control right; chosen."""


class PageTunings(LoggedJobs[TuningJobs]):
    """Starts and cancels tunings, and logs who did it; raises ServoCtrlError and OSError."""

    def __init__(self, directory: Path) -> None:
        super().__init__(TuningJobs(directory / DIRECTORY), LOG_FILE)
        self._watch: asyncio.Task[None] | None = None

    async def start(
        self, machine_file: Path, axis: str, ms: float, who: Requester, controller: Path | None = None
    ) -> None:
        """Start a tuning, on the machine of the controller at this socket if one is given."""
        job = await self.jobs.start(machine_file, axis, ms, who, controller)
        place = "simulator" if controller is None else "machine"
        await self.log(who, "start", job, machine_file=str(machine_file), axis=axis, ms=ms, place=place)

    def end_unless(self, permitted: Callable[[], bool]) -> None:
        """Cancel the running tuning as soon as its requester may no longer move the machine."""
        self._watch = asyncio.create_task(self._watched(self.jobs.running, permitted))

    async def _watched(self, job: Job | None, permitted: Callable[[], bool]) -> None:
        while job is not None and job.state not in ENDED:  # a right has no event
            if not permitted():
                await self.jobs.cancel()
            await asyncio.sleep(WATCH_S)


@cache
def page_tunings_of(directory: Path) -> PageTunings:
    """Return the one instance for a directory."""
    tunings = PageTunings(directory)
    app.on_shutdown(tunings.jobs.cancel)
    return tunings
