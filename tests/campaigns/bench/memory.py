"""Resident memory while the table makes a part, recorded, with the operator's page open in one client.

`hil-sim run` and `servo-ctrl run --record --hmi --serve` in real time, as a user starts them, and one Scope
page that is kept up to date as a browser would (`hmi_pages.py`). What a browser itself takes is not counted.
For root the policy is SCHED_FIFO, which keeps a busy computer from stopping the machine: that would end what
is looked at.
"""

import asyncio
import contextlib
import os
import signal
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Callable, Iterator
from pathlib import Path

from servo_ctrl.hil_rig.simulated_machine import simulated_machine
from tests.campaigns.bench.outcome import Ratio, Section
from tests.campaigns.bench.process_time import children, command_line
from tests.support.free_port import free_tcp_port

HERE = Path(__file__).parent
MACHINE = HERE.parents[2] / "machines" / "xy_table"
PROGRAM = HERE / "circle.toml"
AIMS_MB = {"simulator": 150.0, "daemon": 200.0, "page": 200.0}
OPEN_LIMIT_S = 65.0
"""More than a page waits for its server."""
WATCHED_S = 15.0
"""The part takes six seconds; the page starts beside it."""
PAUSE_S = 0.2
FIFO = os.geteuid() == 0


def _resident_mb(pid: int) -> float:
    """Resident memory of a process, 0 when it has ended."""
    with contextlib.suppress(OSError):
        for line in Path(f"/proc/{pid}/status").read_text().splitlines():
            if line.startswith("VmRSS:"):
                return int(line.split()[1]) * 1024e-6
    return 0.0


def resident_by_role_mb(daemon: int) -> dict[str, float]:
    """Resident memory of the processes that run, by role; of several of a role, the largest."""
    resident_mb = {"daemon": _resident_mb(daemon)}
    for pid in _descendants(os.getpid()):
        with contextlib.suppress(OSError):
            line = command_line(pid)
            for role, part in (("simulator", "hil-sim"), ("page", "servo_ctrl.hmi")):
                if part in line:
                    resident_mb[role] = max(resident_mb.get(role, 0.0), _resident_mb(pid))
    return resident_mb


def _descendants(pid: int) -> Iterator[int]:
    for child in children(pid):
        yield child
        yield from _descendants(child)


@contextlib.asynccontextmanager
async def served(bus: str, address: str, folder: Path) -> AsyncIterator[int]:
    """The daemon with its page; its process id. It is stopped as by Ctrl-C."""
    program = str(Path(sys.executable).with_name("servo-ctrl"))
    given = ("--machine", str(MACHINE), "--program", str(PROGRAM), "--bus", bus, "--pacing", "realtime")
    page = ("--record", str(folder / "recording"), "--learned", str(folder), "--hmi", address, "--serve")
    policy = ["--fifo"] if FIFO else []
    log = folder / "daemon.log"
    with log.open("wb") as output:
        daemon = await asyncio.create_subprocess_exec(
            *(program, "run", *given, *page, *policy),
            stdin=asyncio.subprocess.DEVNULL,
            stdout=output,
            stderr=asyncio.subprocess.STDOUT,
        )
    try:
        yield daemon.pid
    finally:
        if daemon.returncode is not None:
            raise RuntimeError(f"the daemon ended early: {log.read_text(encoding='utf-8')[-500:]}")
        daemon.send_signal(signal.SIGINT)
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(daemon.wait(), OPEN_LIMIT_S)


@contextlib.asynccontextmanager
async def one_page(address: str) -> AsyncIterator[None]:
    """A Scope page that is open."""
    client = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "tests.campaigns.bench.hmi_pages", f"http://{address}", "1", "/scope"),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
    )
    assert client.stdout is not None
    try:
        answer = await asyncio.wait_for(client.stdout.readline(), OPEN_LIMIT_S)
        if answer.strip() != b"open":
            raise RuntimeError(f"the page did not open: {answer.decode().strip()}")
        yield
    finally:
        if client.returncode is None:
            client.terminate()
        await client.wait()


def measure(progress: Callable[[str], None]) -> Section:
    """The largest of what each process has in memory, looked at again and again."""
    progress("memory")
    return asyncio.run(_measure())


async def _measure() -> Section:
    address = f"127.0.0.1:{free_tcp_port()}"
    most_mb: dict[str, float] = {}
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        async with (
            simulated_machine(MACHINE, "realtime", fifo=FIFO) as bus,
            served(bus, address, Path(folder)) as daemon,
            one_page(address),
        ):
            until_s = time.monotonic() + WATCHED_S
            while time.monotonic() < until_s:
                for role, resident_mb in resident_by_role_mb(daemon).items():
                    most_mb[role] = max(most_mb.get(role, 0.0), resident_mb)
                await asyncio.sleep(PAUSE_S)
    ratios = [
        Ratio(f"memory, {role}, of its aim", most_mb[role], aim_mb, "MB", 1.0, at_most=True)
        for role, aim_mb in AIMS_MB.items()
        if role in most_mb
    ]
    return Section("memory", {"resident_mb": most_mb}, ratios, [])
