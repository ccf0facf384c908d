"""The tunings on the simulator of the page's process: the same for all browsers, each action logged."""

from functools import cache
from pathlib import Path

from nicegui import app

from servo_ctrl.commands.local_messages import Who
from servo_ctrl.hmi.shell.logged_jobs import LoggedJobs
from servo_ctrl.hmi.tuning.job import TuningJobs

DIRECTORY, LOG_FILE = "tunings", "tune.jsonl"


class SimulatorTunings(LoggedJobs[TuningJobs]):
    """Starts and cancels tunings, and logs who did it; raises ServoCtrlError and OSError."""

    def __init__(self, directory: Path) -> None:
        super().__init__(TuningJobs(directory / DIRECTORY), LOG_FILE)

    async def start(self, machine_file: Path, axis: str, ms: float, who: Who) -> None:
        """Start a tuning."""
        job = await self.jobs.start(machine_file, axis, ms, who.user)
        await self.log(who, "start", job, machine_file=str(machine_file), axis=axis, ms=ms)


@cache
def simulator_tunings_of(directory: Path) -> SimulatorTunings:
    """The one instance for a directory."""
    tunings = SimulatorTunings(directory)
    app.on_shutdown(tunings.jobs.cancel)
    return tunings
