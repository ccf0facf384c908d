"""Diagnoses by the program `reconcile`: one at a time, in a process of its own.

reconcile is never imported.
"""

import asyncio
from collections.abc import Sequence
from pathlib import Path

from servo_ctrl.hmi.diagnosis.job_files import read_model
from servo_ctrl.hmi.shell.program_jobs import Job, ProgramJobs
from servo_ctrl.hmi.shell.program_process import JobError, installed_program

PROGRAM, ARGUMENTS = "reconcile", ("diagnose", "--progress", "json")


class DiagnosisJobs(ProgramJobs):
    """The diagnoses of this process, each in a directory below `directory`."""

    def __init__(self, directory: Path, command: Sequence[str] | None = None) -> None:
        """`command`: the program and its first arguments, in place of the installed reconcile."""
        super().__init__(directory, PROGRAM)
        self._command = command

    async def start(self, recordings: Sequence[Path], model: Path, who: str) -> Job:
        """Start a diagnosis. Raises ServoCtrlError with the reason when it cannot be started."""
        if self.busy:
            raise JobError("a diagnosis is running already; wait for it or cancel it")
        return await self.launch(
            self._command_for(recordings, model), [str(path) for path in recordings], who
        )

    async def _command_for(self, recordings: Sequence[Path], model: Path) -> list[str]:
        """Return the program with its files, which are checked before anything starts."""
        if not recordings:
            raise JobError("pick at least one recording")
        for path in recordings:
            if not await asyncio.to_thread(path.exists):
                raise JobError(f"{path}: there is no such recording")
        await asyncio.to_thread(read_model, model)
        return [*(self._command or installed_command()), *map(str, recordings), "--model", str(model)]


def installed_command() -> tuple[str, ...]:
    """Return the installed reconcile with its first arguments. Raises JobError."""
    return (installed_program(PROGRAM), *ARGUMENTS)
