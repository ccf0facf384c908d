"""Jobs of the page: an installed program, one at a time, in a process of its own.

The program is started, prints its steps in JSON, and writes files into the directory of the job. A log says
who started, cancelled or accepted what.
"""

import asyncio
import contextlib
import json
import logging
import os
import secrets
import signal
from collections.abc import Awaitable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from servo_ctrl.commands.local_messages import Requester
from servo_ctrl.config.file_format import FORMAT
from servo_ctrl.hmi.languages.texts import word
from servo_ctrl.hmi.shell.program_process import JobError, lines_of, signal_group, started_process
from servo_ctrl.recording.command_log import append_line

INTERRUPT_TIMEOUT_S = 10.0
"""Bounds the wait for the program to end after SIGINT, seconds, before it is killed; chosen: it ends at
its next step."""
MAX_DURATION_S = 4.0 * 3600.0
"""Bounds a job, seconds; chosen: a job takes minutes."""
MAX_LINES = 200
"""Bounds the last lines of the output that are kept; chosen."""
MAX_JOBS = 20
"""Bounds the jobs that the page lists; chosen. The files of older ones stay on the disk."""
EXIT_INTERRUPTED = 130
"""Exit status of a program after SIGINT: 128 + 2, from the shell's convention."""

_LOG = logging.getLogger(__name__)


class ProgressLine(BaseModel):
    """A line of a program with `--progress json`."""

    model_config = ConfigDict(frozen=True, extra="ignore", strict=True)

    format: Literal[1]
    step: Annotated[str, Field(max_length=200)]
    """The step that begins, in words."""
    done: Annotated[int, Field(ge=0)]
    of: Annotated[int, Field(ge=1)]


class JobState(StrEnum):
    """The states of a job."""

    RUNNING = "running"
    CANCELLING = "cancelling"
    DONE = "done"
    CANCELLED = "cancelled"
    FAILED = "failed"


ENDED = (JobState.DONE, JobState.CANCELLED, JobState.FAILED)


@dataclass
class Job:
    """One run of the program."""

    directory: Path
    subjects: tuple[str, ...]
    """What it is about: the recordings of a diagnosis, the axis of a tuning."""
    who: str
    started: datetime
    key: str = field(default_factory=lambda: secrets.token_urlsafe(12))
    """Name in the addresses of its files; nobody can guess it."""
    state: JobState = JobState.RUNNING
    ended: datetime | None = None
    reason: str = ""
    """Why it failed or was cancelled."""
    lines: list[str] = field(default_factory=list)
    """The last lines that it printed."""
    step: str = word("starting")
    progress: float = 0.0
    """Share of completed steps, 0 to 1."""

    @property
    def elapsed_s(self) -> float:
        """Seconds until now, or until its end."""
        return ((self.ended or datetime.now(UTC)) - self.started).total_seconds()


class ProgramJobs:
    """The jobs of one program in this process, each in a directory below `directory`."""

    def __init__(self, directory: Path, program: str, log_file: str) -> None:
        self.directory = directory
        self._log_file = directory / log_file
        self.jobs: list[Job] = []
        """The newest last."""
        self._program = program
        self._process: asyncio.subprocess.Process | None = None
        self._task: asyncio.Task[None] | None = None
        self._start_lock = asyncio.Lock()

    @property
    def running(self) -> Job | None:
        """The job that has not ended."""
        return next((job for job in self.jobs if job.state not in ENDED), None)

    @property
    def busy(self) -> bool:
        """Whether a job runs or is being started."""
        return self._start_lock.locked() or self.running is not None

    def job(self, key: str) -> Job | None:
        """Return the job with this key."""
        # as bytes: of texts, only ASCII can be compared
        return next((j for j in self.jobs if secrets.compare_digest(j.key.encode(), key.encode())), None)

    async def launch(
        self, command: Awaitable[Sequence[str]], subjects: Sequence[str], who: Requester, **details: object
    ) -> Job:
        """Start the program with its arguments and `--out`, and log it; `busy` is asked before.

        `command` has checked them before it returns them. Raises ServoCtrlError with the reason when it
        cannot be started.
        """
        async with self._start_lock:
            arguments = await command
            started = datetime.now(UTC)
            directory = self.directory / started.strftime("%Y%m%dT%H%M%S.%f")
            try:
                await asyncio.to_thread(directory.mkdir, parents=True, mode=0o700)
            except OSError as error:
                raise JobError(f"{directory}: cannot be made: {error.strerror}") from None
            self._process = await started_process([*arguments, "--out", str(directory)])
            job = Job(directory, tuple(subjects), who.user, started)
            self.jobs = [*self.jobs, job][-MAX_JOBS:]
            self._task = asyncio.create_task(_follow(job, self._process, self._program))
        await self.log(who, "start", job, **details)
        return job

    async def log(self, who: Requester, what: str, job: Job, **details: object) -> None:
        """Log what somebody did to a job, with these details."""
        details = {"role": who.role, "address": who.address, "job": job.directory.name, **details}
        await asyncio.to_thread(log_action, self._log_file, who.user, what, details)

    async def cancel(self, who: Requester | None = None) -> None:
        """Interrupt the running job as Ctrl-C would, kill it if it does not end, and wait for its end.

        `who` asked for it; None: nobody did.
        """
        job, process, task = self.running, self._process, self._task
        if job is None or process is None or task is None:
            return
        if who is not None:
            await self.log(who, "cancel", job)
        job.state = JobState.CANCELLING
        signal_group(process, signal.SIGINT)
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(INTERRUPT_TIMEOUT_S):
                await asyncio.shield(task)
        if not task.done():
            signal_group(process, signal.SIGKILL)
            await asyncio.shield(task)


def log_action(log: Path, who: str, what: str, details: dict[str, object]) -> None:
    """Append to a log who did what and when, one JSON object a line. Raises OSError."""
    moment = datetime.now(UTC).isoformat(timespec="milliseconds")
    entry = {"format": FORMAT, "time": moment, "who": who, "what": what, **details}
    log.parent.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(log, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o600)
    try:
        append_line(descriptor, json.dumps(entry, default=str).encode() + b"\n")
    finally:
        os.close(descriptor)


async def _follow(job: Job, process: asyncio.subprocess.Process, program: str) -> None:
    """Read the output until the process ends, then set the state of the job."""
    code: int | None = None
    try:
        async with asyncio.timeout(MAX_DURATION_S):
            async for line in lines_of(process):
                _note_line(job, line)
            code = await process.wait()
    except TimeoutError:
        job.reason = f"it did not end within {MAX_DURATION_S / 3600.0:g} h"
    except Exception as error:  # noqa: BLE001  # a job that never ends would keep every other from starting
        _LOG.exception("the output of %s could not be read", program)
        job.reason = f"its output could not be read: {type(error).__name__}: {error}"
    finally:
        signal_group(process, signal.SIGKILL)  # its own children too
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(INTERRUPT_TIMEOUT_S):
                await process.communicate()  # its pipe is closed with it
    job.ended = datetime.now(UTC)
    if code == 0:
        job.state, job.progress = JobState.DONE, 1.0
    elif code is not None and (job.state is JobState.CANCELLING or code == EXIT_INTERRUPTED):
        job.state, job.reason = JobState.CANCELLED, "cancelled; nothing is half written"
    else:
        job.state, job.reason = JobState.FAILED, job.reason or _failure(job.lines, code, program)


def _note_line(job: Job, line: str) -> None:
    with contextlib.suppress(ValidationError):
        progress = ProgressLine.model_validate_json(line)
        job.step, job.progress, line = progress.step, min(1.0, progress.done / progress.of), progress.step
    job.lines = [*job.lines, line][-MAX_LINES:]


def _failure(lines: Sequence[str], code: int | None, program: str) -> str:
    """Return the last error message of the program, else its exit status and last line."""
    prefix = f"{program}: "
    errors = [line.removeprefix(prefix) for line in lines if line.startswith(prefix)]
    if errors:
        return errors[-1]
    last = next((line for line in reversed(lines) if line), "it printed nothing")
    return f"it ended with {code}: {last}"
