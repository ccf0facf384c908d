"""The process of a job of the page: an installed program that is started, read line by line and signalled."""

import asyncio
import contextlib
import os
import shutil
import signal
import sysconfig
from collections.abc import AsyncIterator, Callable, Sequence

from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.hil_rig.simulated_machine import ends_with_its_parent

ONE_CORE = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
"""Environment of the program: the other cores are for the machine, which may be running."""
NICENESS = 15
"""Of the program: the machine, which may be running, goes first, then the page, which has 10; chosen."""
MAX_LINE_LENGTH = 2000
"""Bounds the characters of a line that are kept; chosen: a line of a step has about 100."""


class JobError(ServoCtrlError):
    """A job cannot be started."""


def installed_program(name: str) -> str:
    """Return the installed program beside this interpreter, else on the search path. Raises JobError."""
    program = shutil.which(name, path=sysconfig.get_path("scripts")) or shutil.which(name)
    if program is None:
        raise JobError(f"the program {name} is not installed; install servo-ctrl with its programs")
    return program


def _lowered_priority(begin: Callable[[], object] | None) -> Callable[[], object]:
    """Return what the child calls before it begins: the machine, which may be running, goes first."""

    def lower_priority() -> None:
        os.nice(max(NICENESS - os.nice(0), 0))  # the page's own is inherited; only root goes back
        if begin is not None:
            begin()

    return lower_priority


async def started_process(command: Sequence[str]) -> asyncio.subprocess.Process:
    """Start a program with its output in a pipe, as the leader of a process group. Raises JobError."""
    try:
        return await asyncio.create_subprocess_exec(
            *command,
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
            env=os.environ | ONE_CORE,
            start_new_session=True,
            preexec_fn=_lowered_priority(ends_with_its_parent()),
        )
    except OSError as error:
        raise JobError(f"{command[0]}: cannot be started: {error.strerror}") from None


async def lines_of(process: asyncio.subprocess.Process) -> AsyncIterator[str]:
    """Yield the lines of the output, cut to MAX_LINE_LENGTH; output without line ends is bounded too."""
    partial_line = b""
    while process.stdout is not None and (chunk := await process.stdout.read(65536)):
        *lines, partial_line = (partial_line + chunk).split(b"\n")
        for line in lines:
            yield line.decode(errors="replace").strip()[:MAX_LINE_LENGTH]
        partial_line = partial_line[:MAX_LINE_LENGTH]
    if partial_line:
        yield partial_line.decode(errors="replace").strip()


def signal_group(process: asyncio.subprocess.Process, number: signal.Signals) -> None:
    """Signal the process group, which the process leads: itself and its children."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, number)
