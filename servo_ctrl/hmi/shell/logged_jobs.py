"""The jobs of a program in the page's process, with a log of who started, cancelled or accepted what."""

import asyncio
from typing import Generic, TypeVar

from servo_ctrl.commands.local_messages import Requester
from servo_ctrl.hmi.shell.action_log import log_action
from servo_ctrl.hmi.shell.program_jobs import Job, ProgramJobs

Jobs = TypeVar("Jobs", bound=ProgramJobs)


class LoggedJobs(Generic[Jobs]):
    """The jobs, and the log in the directory that has their files; raises ServoCtrlError and OSError."""

    def __init__(self, jobs: Jobs, log_file: str) -> None:
        self.jobs = jobs
        self._log = jobs.directory / log_file

    async def cancel(self, who: Requester) -> None:
        """Cancel the running job and wait for its end."""
        job = self.jobs.running
        if job is not None:
            await self.log(who, "cancel", job)
            await self.jobs.cancel()

    async def log(self, who: Requester, what: str, job: Job, **details: object) -> None:
        """Log what somebody did to a job, with these details."""
        details = {"role": who.role, "address": who.address, "job": job.directory.name, **details}
        await asyncio.to_thread(log_action, self._log, who.user, what, details)
