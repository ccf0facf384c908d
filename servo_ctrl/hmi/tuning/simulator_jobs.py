"""The tunings on the simulator of the page's process: the same for all browsers, each action logged."""

import asyncio
from functools import cache
from pathlib import Path

from nicegui import app

from servo_ctrl.commands.local_messages import Who
from servo_ctrl.hmi.shell.action_log import log_action
from servo_ctrl.hmi.shell.program_jobs import Job
from servo_ctrl.hmi.tuning.job import TuningJobs

DIRECTORY, LOG_FILE = "tunings", "tune.jsonl"


class SimulatorTunings:
    """Starts and cancels tunings, and logs who did it; raises ServoCtrlError and OSError."""

    def __init__(self, directory: Path) -> None:
        self.jobs = TuningJobs(directory / DIRECTORY)
        self._log = directory / DIRECTORY / LOG_FILE

    async def start(self, machine_file: Path, axis: str, ms: float, who: Who) -> None:
        """Start a tuning."""
        job = await self.jobs.start(machine_file, axis, ms, who.user)
        await self._log_action(who, "start", job, machine_file=str(machine_file), axis=axis, ms=ms)

    async def cancel(self, who: Who) -> None:
        """Cancel the running tuning and wait for its end."""
        job = self.jobs.running
        if job is not None:
            await self._log_action(who, "cancel", job)
            await self.jobs.cancel()

    async def _log_action(self, who: Who, what: str, job: Job, **details: object) -> None:
        details = {"role": who.role, "address": who.address, "job": job.directory.name, **details}
        await asyncio.to_thread(log_action, self._log, who.user, what, details)


@cache
def simulator_tunings_of(directory: Path) -> SimulatorTunings:
    """The one instance for a directory."""
    tunings = SimulatorTunings(directory)
    app.on_shutdown(tunings.jobs.cancel)
    return tunings
