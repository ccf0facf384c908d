"""Diagnoses by the program `reconcile`: one at a time, in a process of its own, the same for all browsers.

reconcile is never imported. Browsers get the files of a diagnosis by HTTP.
"""

import asyncio
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from nicegui import app
from starlette.responses import FileResponse, HTMLResponse, PlainTextResponse, Response  # FastAPI reads it

from servo_ctrl.commands.local_messages import Requester
from servo_ctrl.files.diagnosis_files import MODEL_FILE, REPORT_FILE
from servo_ctrl.hmi.diagnosis.job_files import MEDIA_TYPES, accept_model, read_model
from servo_ctrl.hmi.languages.report_page import translated_report
from servo_ctrl.hmi.languages.texts import ENGLISH, LANGUAGES
from servo_ctrl.hmi.shell.program_jobs import Job, JobState, ProgramJobs
from servo_ctrl.hmi.shell.program_process import JobError, installed_program

PROGRAM, ARGUMENTS = "reconcile", ("diagnose", "--progress", "json")
DIRECTORY, LOG_FILE = "diagnoses", "reconcile.jsonl"
ADDRESS = "/diagnosis"


class Diagnoses(ProgramJobs):
    """The diagnoses of this process."""

    def __init__(self, directory: Path) -> None:
        super().__init__(directory / DIRECTORY, PROGRAM, LOG_FILE)

    async def start(self, recordings: Sequence[Path], model: Path, who: Requester) -> Job:
        """Start a diagnosis. Raises ServoCtrlError with the reason when it cannot be started."""
        if self.busy:
            raise JobError("a diagnosis is running already; wait for it or cancel it")
        paths = [str(path) for path in recordings]
        command = _command_for(recordings, model)
        return await self.launch(command, paths, who, recordings=paths, model=str(model))

    async def accept(self, job: Job, target: Path, who: Requester) -> Path | None:
        """Copy the repaired model into use; return the path of the old one, None without one."""
        kept = await asyncio.to_thread(accept_model, job.directory / MODEL_FILE, target, who.user)
        await self.log(who, "accept", job, target=str(target), kept=str(kept or ""))
        return kept

    def address(self, job: Job, name: str, language: str) -> str:
        """Return the address at which a browser finds a file of a diagnosis; its report in this language."""
        return f"{ADDRESS}/{job.key}/{name}?language={language}"

    def response(self, key: str, name: str, language: str) -> Response:
        """Return a file of a diagnosis as a download: as a page it would have the rights of our own pages."""
        job, media_type = self.job(key), MEDIA_TYPES.get(name)
        done = job is not None and job.state is JobState.DONE
        path = job.directory / name if job is not None and done and media_type is not None else None
        if path is None or not path.is_file():
            return PlainTextResponse("there is no such file", 404)
        headers = {"cache-control": "no-store"}
        if name == REPORT_FILE and language != ENGLISH and language in LANGUAGES:
            headers["content-disposition"] = f'attachment; filename="{name}"'
            return HTMLResponse(translated_report(path.read_text("utf-8"), language), headers=headers)
        return FileResponse(path, media_type=media_type, filename=name, headers=headers)


async def _command_for(recordings: Sequence[Path], model: Path) -> list[str]:
    """Return the program with its files, which are checked before anything starts."""
    if not recordings:
        raise JobError("pick at least one recording")
    for path in recordings:
        if not await asyncio.to_thread(path.exists):
            raise JobError(f"{path}: there is no such recording")
    await asyncio.to_thread(read_model, model)
    return [*installed_command(), *map(str, recordings), "--model", str(model)]


def installed_command() -> tuple[str, ...]:
    """Return the installed reconcile with its first arguments. Raises JobError."""
    return (installed_program(PROGRAM), *ARGUMENTS)


@cache
def diagnoses_of(directory: Path) -> Diagnoses:
    """Return the one instance for a directory; the first call adds the route of its files."""
    diagnoses = Diagnoses(directory)

    @app.get(f"{ADDRESS}/{{key}}/{{name}}")
    def job_file(key: str, name: str, language: str = ENGLISH) -> Response:
        return diagnoses.response(key, name, language)

    app.on_shutdown(diagnoses.cancel)
    return diagnoses
