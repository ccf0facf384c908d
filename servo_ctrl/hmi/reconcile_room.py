"""The diagnoses of the page process: the same for all browsers, noted in a log; their files by HTTP."""

from __future__ import annotations

import asyncio
from functools import cache
from typing import TYPE_CHECKING

from nicegui import app
from starlette.responses import FileResponse, PlainTextResponse, Response  # FastAPI reads the annotation

from servo_ctrl.hmi.reconcile_job import COMMAND, Diagnoses, JobState
from servo_ctrl.hmi.reconcile_job_files import SERVED, accept_model, note_line

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from servo_ctrl.config.local_messages import Who
    from servo_ctrl.hmi.reconcile_job import Job

FOLDER, LOG = "diagnoses", "reconcile.jsonl"
ADDRESS = "/diagnosis"


class Room:
    """What can be done with diagnoses; who does it is noted. All methods raise ServoCtrlError and OSError."""

    def __init__(self, directory: Path) -> None:
        self.diagnoses = Diagnoses(directory / FOLDER, COMMAND)
        self._log = directory / FOLDER / LOG

    async def start(self, recordings: Sequence[Path], model: Path, who: Who) -> Job:
        """Start one."""
        job = await self.diagnoses.start(recordings, model, who.user)
        await self._note(who, "start", job, recordings=[str(path) for path in recordings], model=str(model))
        return job

    async def cancel(self, who: Who) -> None:
        """Cancel the one that is running; returns when it has ended."""
        job = self.diagnoses.running
        if job is not None:
            await self._note(who, "cancel", job)
            await self.diagnoses.cancel()

    async def accept(self, job: Job, target: Path, who: Who) -> Path | None:
        """Copy its repaired model into use; returns where the old one is kept."""
        kept = await asyncio.to_thread(accept_model, job.directory / "model.toml", target, who.user)
        await self._note(who, "accept", job, target=str(target), kept=str(kept or ""))
        return kept

    def address(self, job: Job, name: str) -> str:
        """Where a browser finds a file of a diagnosis."""
        return f"{ADDRESS}/{job.key}/{name}"

    def answer(self, key: str, name: str) -> Response:
        """A file of a diagnosis, to be kept: as a page it would have the rights of ours."""
        job, kind = self.diagnoses.job(key), SERVED.get(name)
        if job is None or kind is None or job.state is not JobState.DONE:
            return PlainTextResponse("there is no such file", 404)
        path = job.directory / name
        if not path.is_file():
            return PlainTextResponse("there is no such file", 404)
        return FileResponse(path, media_type=kind, filename=name, headers={"cache-control": "no-store"})

    async def _note(self, who: Who, what: str, job: Job, **details: object) -> None:
        details = {"role": who.role, "address": who.address, "job": job.directory.name, **details}
        await asyncio.to_thread(note_line, self._log, who.user, what, details)


@cache
def room_of(directory: Path) -> Room:
    """The one room of a directory; the first call makes it and its address."""
    room = Room(directory)

    @app.get(f"{ADDRESS}/{{key}}/{{name}}")
    def file_of_job(key: str, name: str) -> Response:
        return room.answer(key, name)

    app.on_shutdown(room.diagnoses.cancel)
    return room
