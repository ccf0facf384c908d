"""A simulated machine on an embedded bus of its own: `hil-sim`, a process beside ours that serves the bus."""

import asyncio
import contextlib
import ctypes
import signal
import sys
import tempfile
from collections.abc import AsyncIterator, Callable
from functools import partial
from pathlib import Path

from servo_ctrl.errors import ServoCtrlError

PR_SET_PDEATHSIG = 1
READY_TIMEOUT_S = 900.0
"""Bounds a hang. A first start compiles the plant's kernels: 20 s of a processor, minutes of a busy one."""
STOP_TIMEOUT_S = 10.0
"""Bounds the wait for the end of the process; chosen."""
LINES_KEPT = 1000
"""Bounds the lines kept of its output; chosen."""


class SimulatorError(ServoCtrlError):
    """The simulator did not start."""


@contextlib.asynccontextmanager
async def simulated_machine(machine: Path, pacing: str, *, fifo: bool = False) -> AsyncIterator[str]:
    """Start the simulator for a machine directory or a plant file; yield the bus that it serves; stop it.

    `fifo`: with a real-time priority and locked memory.

    Raises:
        SimulatorError: it ended or was not ready within its bound; carries what it printed.

    """
    with tempfile.TemporaryDirectory(prefix="servo-ctrl-") as folder:
        bus = f"localcan:{Path(folder) / 'can.sock'}"
        simulator = [
            str(Path(sys.executable).with_name("hil-sim")),
            *("run", "--machine", str(machine), "--bus", bus, "--pacing", pacing),
            *(["--fifo"] if fifo else []),
        ]
        async with running("hil-sim", simulator, "on the bus"):
            yield bus


@contextlib.asynccontextmanager
async def running(name: str, command: list[str], ready: str) -> AsyncIterator[list[str]]:
    """Run `command` until the block is left; enter once it has printed a line with `ready` in it.

    Yields its last lines, which go on growing. Raises SimulatorError when it is not ready within its bound.
    """
    process = await asyncio.create_subprocess_exec(
        *command,
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT,
        start_new_session=True,  # Ctrl-C reaches us alone: the axes ramp down with their drives still there
        preexec_fn=ends_with_its_parent(),
    )
    printed: list[str] = []
    drain: asyncio.Task[None] | None = None
    try:
        try:
            async with asyncio.timeout(READY_TIMEOUT_S):
                await _read(process, printed, ready)
        except TimeoutError:
            bound = f"{READY_TIMEOUT_S:g} s"
            raise SimulatorError(f"{name} was not ready within {bound}: {_last(printed)}") from None
        if process.returncode is not None or not printed or ready not in printed[-1]:
            raise SimulatorError(f"{name} did not start: {_last(printed)}")
        drain = asyncio.create_task(_read(process, printed))
        yield printed
    finally:
        if process.returncode is None:
            process.terminate()
        try:
            async with asyncio.timeout(STOP_TIMEOUT_S):
                await process.wait()
        except TimeoutError:
            process.kill()
            await process.wait()
        if drain is not None:
            await drain


def ends_with_its_parent() -> Callable[[], object] | None:
    """Return a function that a child calls first, so that it ends when its parent is killed."""
    if not sys.platform.startswith("linux"):
        return None
    return partial(ctypes.CDLL(None).prctl, PR_SET_PDEATHSIG, signal.SIGTERM)


async def _read(process: asyncio.subprocess.Process, printed: list[str], until: str | None = None) -> None:
    """Read the pipe to its end, or to a line with `until` in it; keep the last lines."""
    if process.stdout is None:
        raise SimulatorError("no pipe to the process")
    async for line in process.stdout:
        printed.append(line.decode(errors="replace").strip())
        del printed[:-LINES_KEPT]
        if until is not None and until in printed[-1]:
            return


def _last(printed: list[str]) -> str:
    return " | ".join(printed[-3:]) or "it printed nothing"
