"""Diagnoses by `reconcile`: a program of its own, one at a time, which outlives the browser that started it.

reconcile is never imported: it is started as the simulator is, tells its steps in JSON, and leaves files.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import secrets
import signal
import sys
from dataclasses import dataclass, field
from datetime import UTC, datetime
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.experiment.simulated_machine import ends_with_its_parent
from servo_ctrl.hmi.reconcile_job_files import axes_of_model

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

COMMAND = (sys.executable, "-m", "reconcile.cli.main", "diagnose", "--progress", "json")
ONE_CORE = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
"""The machine may be running beside it."""
INTERRUPT_S = 10.0
"""What a diagnosis gets for ending by itself after SIGINT; then it is killed."""
LONGEST_S = 4.0 * 3600.0
LINES_KEPT = 200
LONGEST_LINE = 2000
JOBS_KEPT = 20
INTERRUPTED = 130


class JobError(ServoCtrlError):
    """A diagnosis that cannot be started."""


class Step(BaseModel):
    """A line of `reconcile diagnose --progress json`."""

    model_config = ConfigDict(frozen=True, extra="ignore", strict=True)

    format: Literal[1]
    step: Annotated[str, Field(max_length=200)]
    """What begins, in words."""
    done: Annotated[int, Field(ge=0)]
    """Steps that are over."""
    of: Annotated[int, Field(ge=1)]


class JobState(StrEnum):
    """Where a diagnosis is."""

    RUNNING = "running"
    CANCELLING = "cancelling"
    DONE = "done"
    CANCELLED = "cancelled"
    FAILED = "failed"


ENDED = (JobState.DONE, JobState.CANCELLED, JobState.FAILED)


@dataclass
class Job:
    """One diagnosis."""

    directory: Path
    recordings: tuple[Path, ...]
    model: Path
    axes: tuple[str, ...]
    who: str
    started: datetime
    key: str = field(default_factory=lambda: secrets.token_urlsafe(12))
    """Names it in addresses; nobody guesses it."""
    state: JobState = JobState.RUNNING
    ended: datetime | None = None
    reason: str = ""
    """Why it failed, in words."""
    lines: list[str] = field(default_factory=list)
    """The last ones it printed."""
    step: str = "starting"
    progress: float = 0.0
    """0 to 1, by the steps that are over."""

    @property
    def elapsed_s(self) -> float:
        """Seconds so far, or until its end."""
        return ((self.ended or datetime.now(UTC)) - self.started).total_seconds()


class Diagnoses:
    """The diagnoses of this process, below `directory`; nothing is made there before the first one."""

    def __init__(self, directory: Path, command: Sequence[str] = COMMAND) -> None:
        self.directory = directory
        self.jobs: list[Job] = []
        """The newest last."""
        self._command = tuple(command)
        self._process: asyncio.subprocess.Process | None = None
        self._task: asyncio.Task[None] | None = None
        self._starting = False

    @property
    def running(self) -> Job | None:
        """The one that has not ended."""
        return next((job for job in self.jobs if job.state not in ENDED), None)

    def job(self, key: str) -> Job | None:
        """By its key."""
        return next((job for job in self.jobs if secrets.compare_digest(job.key, key)), None)

    async def start(self, recordings: Sequence[Path], model: Path, who: str) -> Job:
        """Start a diagnosis. Raises JobError, with the reason, when it cannot be."""
        if self._starting or self.running is not None:
            raise JobError("a diagnosis is running already; wait for it or cancel it")
        self._starting = True
        try:
            return await self._start(recordings, model, who)
        finally:
            self._starting = False

    async def cancel(self) -> None:
        """Interrupt what is running, as Ctrl-C would; kill what does not end. Returns once it has ended."""
        job, process, task = self.running, self._process, self._task
        if job is None or process is None or task is None:
            return
        job.state = JobState.CANCELLING
        _signal(process, signal.SIGINT)
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(INTERRUPT_S):
                await asyncio.shield(task)
        if not task.done():
            _signal(process, signal.SIGKILL)
            await asyncio.shield(task)

    async def _start(self, recordings: Sequence[Path], model: Path, who: str) -> Job:
        if not recordings:
            raise JobError("pick at least one recording")
        for path in recordings:
            if not await asyncio.to_thread(path.exists):
                raise JobError(f"{path}: there is no such recording")
        axes = await asyncio.to_thread(axes_of_model, model)
        started = datetime.now(UTC)
        directory = self.directory / started.strftime("%Y%m%dT%H%M%S.%f")
        try:
            await asyncio.to_thread(directory.mkdir, parents=True, mode=0o700)
        except OSError as error:
            raise JobError(f"{directory}: cannot be made: {error.strerror}") from None
        arguments = [*map(str, recordings), "--model", str(model), "--out", str(directory)]
        try:
            process = await asyncio.create_subprocess_exec(
                *self._command,
                *arguments,
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.STDOUT,
                env=os.environ | ONE_CORE,
                start_new_session=True,
                preexec_fn=ends_with_its_parent(),
            )
        except OSError as error:
            raise JobError(f"{self._command[0]}: cannot be started: {error.strerror}") from None
        job = Job(directory, tuple(recordings), model, axes, who, started)
        self.jobs = [*self.jobs, job][-JOBS_KEPT:]
        self._process, self._task = process, asyncio.create_task(_follow(job, process))
        return job


async def _follow(job: Job, process: asyncio.subprocess.Process) -> None:
    """Read what it prints until it ends; then say how."""
    try:
        async with asyncio.timeout(LONGEST_S):
            await _read(process, lambda line: _note(job, line))
            code = await process.wait()
        overdue = False
    except TimeoutError:
        overdue = True
    finally:
        _signal(process, signal.SIGKILL)  # what it has started, too
    job.ended = datetime.now(UTC)
    if overdue:
        job.state, job.reason = JobState.FAILED, f"it did not end within {LONGEST_S / 3600.0:g} h"
    elif code == 0:
        job.state, job.progress = JobState.DONE, 1.0
    elif job.state is JobState.CANCELLING or code == INTERRUPTED:
        job.state, job.reason = JobState.CANCELLED, "cancelled; nothing is half written"
    else:
        job.state, job.reason = JobState.FAILED, _why(job.lines, code)


async def _read(process: asyncio.subprocess.Process, on_line: Callable[[str], None]) -> None:
    """Its lines, however long; a byte stream without an end of line is cut."""
    if process.stdout is None:
        return
    rest = b""
    while chunk := await process.stdout.read(65536):
        *lines, rest = (rest + chunk).split(b"\n")
        for line in lines:
            on_line(line.decode(errors="replace").strip()[:LONGEST_LINE])
        rest = rest[:LONGEST_LINE]
    if rest:
        on_line(rest.decode(errors="replace").strip()[:LONGEST_LINE])


def _note(job: Job, line: str) -> None:
    with contextlib.suppress(ValidationError):
        said = Step.model_validate_json(line)
        job.step, job.progress, line = said.step, min(1.0, said.done / said.of), said.step
    job.lines = [*job.lines, line][-LINES_KEPT:]


def _why(lines: Sequence[str], code: int) -> str:
    said = [line.removeprefix("reconcile: ") for line in lines if line.startswith("reconcile: ")]
    if said:
        return said[-1]
    last = next((line for line in reversed(lines) if line), "it printed nothing")
    return f"it ended with {code}: {last}"


def _signal(process: asyncio.subprocess.Process, number: signal.Signals) -> None:
    """To it and to what it has started: it leads a process group."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, number)
