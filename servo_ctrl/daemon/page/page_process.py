"""The page's process, as the controller sees it: started before the first SYNC, ended with the run.

Between the two is its keeper (`page_process_keeper`), which starts it again when it dies. Nothing here ever
waits for either of them while the cycle runs.
"""

import asyncio
import contextlib
import os
import sys
from collections import deque
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import NamedTuple

from servo_ctrl.daemon.page.page_process_keeper import ENDED, ends_with_its_parent

END_LIMIT_S = 5.0
LINES_KEPT = 20
LONGEST_LINE = 500
NICENESS = 10
"""Whoever else wants the processor gets it first, the cycle above all."""


class PageOptions(NamedTuple):
    """That there is a local socket, and which process serves it to browsers."""

    arguments: tuple[str, ...] | None
    """Of `python -m servo_ctrl.hmi serve`, beside the socket; None = no process, only the socket."""
    on_socket: Callable[[Path], None] | None = None
    """Told where the socket is."""
    socket: Path | None = None
    """Where to make it, in a directory of this user alone; None = in a new one."""


@contextlib.asynccontextmanager
async def page_process(
    socket: Path, arguments: tuple[str, ...], note: Callable[[str], None]
) -> AsyncIterator[None]:
    """The page runs while the block does; `note` is told when it ends by itself, with its last words."""
    page = [sys.executable, "-m", "servo_ctrl.hmi", "serve", "--socket", str(socket), *arguments]
    async with kept(page, note):
        yield


@contextlib.asynccontextmanager
async def kept(command: list[str], note: Callable[[str], None]) -> AsyncIterator[None]:
    """A command that is started again when it ends, until the block is left."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "servo_ctrl.daemon.page.page_process_keeper"),
        *command,
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        start_new_session=True,  # Ctrl-C is for us
        preexec_fn=_beside_the_cycle,
    )
    told = asyncio.create_task(_read(process, note))
    try:
        yield
    finally:
        if process.stdin is not None:
            process.stdin.close()
        try:
            async with asyncio.timeout(END_LIMIT_S):
                await process.wait()
        except TimeoutError:
            process.kill()  # and the page with it: PDEATHSIG
            await process.wait()
        await told


async def _read(process: asyncio.subprocess.Process, note: Callable[[str], None]) -> None:
    """Keep the pipe empty; pass on that the page has ended, and why."""
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
    """In the child: no priority of the cycle's, and an end with us."""
    with contextlib.suppress(AttributeError, OSError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        os.nice(NICENESS)
    _end_with_us()
