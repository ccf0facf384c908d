"""Starts the page's process before the first SYNC and ends it with the run.

The controller starts `page_supervisor`, which starts the page and restarts it when it dies. The cycle
never waits for either process.
"""

import asyncio
import contextlib
import os
import sys
from collections import deque
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import NamedTuple

from servo_ctrl.daemon.page.page_supervisor import ENDED, ends_with_its_parent

END_LIMIT_S = 5.0
"""Bounds the wait for the end of the supervisor, which waits `STOP_LIMIT_S` for the page; chosen."""
LINES_KEPT = 20
LONGEST_LINE = 500
"""Bound the output of the page that is kept for its last message: lines, and characters of one."""
SUPERVISOR_PAUSE_S = 1.0
"""Pause before the supervisor is restarted."""
SUPERVISOR_RESTARTS_MAX = 8
"""Bounds the restarts of the supervisor in a run; after more there is no page."""
SUPERVISOR_ENDED = "the supervisor of the page's process has ended"
NICENESS = 10
"""Niceness of the page: every other process, above all the cycle, runs first. All numbers are chosen."""


class PageOptions(NamedTuple):
    """Options of the local socket and of the process that serves it to browsers."""

    arguments: tuple[str, ...] | None
    """Arguments of `python -m servo_ctrl.hmi serve` besides the socket; None = only the socket."""
    on_socket: Callable[[Path], None] | None = None
    """Called with the path of the socket."""
    socket: Path | None = None
    """Path of the socket, in a directory that only this user can access; None = in a new one."""


@contextlib.asynccontextmanager
async def kept_running(command: list[str], note: Callable[[str], None]) -> AsyncIterator[None]:
    """Run a command while the block runs; start it again when it or its supervisor ends."""
    supervisors, over = [await _start_supervisor(command, _beside_the_cycle)], asyncio.Event()
    watch = asyncio.create_task(_restart_supervisor(supervisors, command, note, over))
    try:
        yield
    finally:
        over.set()
        process = supervisors[-1]
        if process.stdin is not None:
            process.stdin.close()
        try:
            async with asyncio.timeout(END_LIMIT_S):
                await process.wait()
        except TimeoutError:
            process.kill()  # PDEATHSIG ends the page too
            await process.wait()
        await watch


async def _start_supervisor(
    command: list[str], in_child: Callable[[], object] | None, *prefix: str
) -> asyncio.subprocess.Process:
    return await asyncio.create_subprocess_exec(
        *prefix,
        *(sys.executable, "-m", "servo_ctrl.daemon.page.page_supervisor"),
        *command,
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        process_group=0,  # Ctrl-C is for the controller alone; in another session niceness is void, sched(7)
        preexec_fn=in_child,
    )


async def _restart_supervisor(
    supervisors: list[asyncio.subprocess.Process],
    command: list[str],
    note: Callable[[str], None],
    over: asyncio.Event,
) -> None:
    """Read the supervisor's output, and start another supervisor if it was killed, until the block is over.

    While the cycle runs, the start must not copy memory, so it calls no function in the child. Under
    SCHED_FIFO the child would compete with the cycle until its command runs: there the loss is only logged.
    """
    while True:
        await _read(supervisors[-1], note)
        status = await supervisors[-1].wait()
        if over.is_set():
            return
        again = len(supervisors) <= SUPERVISOR_RESTARTS_MAX and os.sched_getscheduler(0) != os.SCHED_FIFO
        what = (
            f"again in {SUPERVISOR_PAUSE_S:g} s"
            if again
            else "there is no page until the controller is restarted"
        )
        note(f"{SUPERVISOR_ENDED} (status {status}), {what}")
        if not again:
            return
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(SUPERVISOR_PAUSE_S):
                await over.wait()
                return
        supervisors.append(await _start_supervisor(command, None, "nice", "-n", str(NICENESS)))
        started = supervisors[-1].stdin
        if over.is_set() and started is not None:  # the block ended while this supervisor started
            started.close()


async def _read(process: asyncio.subprocess.Process, note: Callable[[str], None]) -> None:
    """Read the supervisor's output; log when the page ends, with its last line."""
    lines: deque[str] = deque(maxlen=LINES_KEPT)
    if process.stdout is None:
        return
    while chunk := await process.stdout.read(4096):
        for line in chunk.decode(errors="replace").splitlines():
            text = line.strip()[:LONGEST_LINE]
            if text.startswith(ENDED):
                note(": ".join(part for part in (text, lines[-1] if lines else "") if part))
                lines.clear()
            elif text:
                lines.append(text)


_end_with_us = ends_with_its_parent()


def _beside_the_cycle() -> None:
    """Drop the cycle's priority and end with the controller; called in the child."""
    with contextlib.suppress(AttributeError, OSError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        os.nice(NICENESS)
    _end_with_us()
