"""Lockstep cycles a second with two axes and two scales on localcan, against the stock canopen exchange.

Ours: the hub and `hil-sim run` as processes, the daemon's `run_machine` in this one: boot, enable, a circle,
controlled stop, with control law, plant and all checks. Stock: the same seven frames a cycle over a hub of
its own, written with canopen's PDO objects and a Notifier on both ends (`stock_canopen.py`), without a law
and without a plant. They take turns.
"""

from __future__ import annotations

import asyncio
import contextlib
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.daemon.supervisor import run_machine
from servo_ctrl.experiment.simulated_machine import simulated_machine
from tests.bench.outcome import Ratio, Section
from tests.bench.process_time import children, command_line, processor_s

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

HERE = Path(__file__).parent
MACHINE = HERE.parents[1] / "machines" / "xy_table"
PROGRAM = HERE / "circle.toml"
STOCK = HERE / "stock_canopen.py"
REPEATS = 5
STOCK_CYCLES = 4000
TIMEOUT_S = 60.0


class Run(NamedTuple):
    """Cycles a second, and processor microseconds a cycle by process."""

    cycles_per_s: float
    processor_us: dict[str, float]


async def run_ours(bus: str, pids: dict[str, int]) -> Run:
    """One run of the circle on a bus where `hil-sim` is; `pids` are the other two processes."""
    machine = load_machine(MACHINE)
    program = load_program(PROGRAM, machine)
    before_s = {role: processor_s(pid) for role, pid in pids.items()}
    own_s = time.process_time()
    report = await run_machine(machine, program, bus, "lockstep")
    own_s = time.process_time() - own_s
    if not report.completed:
        raise RuntimeError(f"the run did not complete: {report.reason}")
    spent_s = {role: processor_s(pid) - before_s[role] for role, pid in pids.items()}
    spent_s["daemon"] = own_s
    return Run(report.cycles / report.wall_s, _per_cycle(spent_s, report.cycles))


def run_stock(socket: Path, hub: int, cycles: int = STOCK_CYCLES) -> Run:
    """One run of the stock exchange over the hub at `socket`, whose process id is `hub`."""
    script = [sys.executable, str(STOCK)]
    with _ready([*script, "devices", str(socket)]) as devices:
        hub_s, devices_s = processor_s(hub), processor_s(devices.pid)
        controller = subprocess.run(
            [*script, "controller", str(socket), str(cycles)],
            capture_output=True,
            text=True,
            timeout=TIMEOUT_S,
            check=True,
        )
        spent_s = {"hub": processor_s(hub) - hub_s}
        with contextlib.suppress(FileNotFoundError):  # it leaves by itself once it has been told to stop
            spent_s["devices"] = processor_s(devices.pid) - devices_s
        devices.wait(TIMEOUT_S)
    return Run(float(controller.stdout), _per_cycle(spent_s, cycles))


@contextlib.contextmanager
def stock_hub() -> Iterator[tuple[Path, int]]:
    """A hub of its own: its socket and its process id."""
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        socket = Path(folder) / "can.sock"
        with _ready([sys.executable, "-m", "local_can", str(socket)]) as hub:
            yield socket, hub.pid
            hub.terminate()


def measure(progress: Callable[[str], None]) -> Section:
    """Both exchanges in turn."""
    return asyncio.run(_measure(progress))


async def _measure(progress: Callable[[str], None]) -> Section:
    ours: list[Run] = []
    stock: list[Run] = []
    async with simulated_machine(MACHINE, "lockstep") as bus:
        pids = {_role(pid): pid for pid in children()}
        with stock_hub() as (socket, hub):
            for repeat in range(REPEATS):
                progress(f"lockstep: repeat {repeat + 1} of {REPEATS}")
                ours.append(await run_ours(bus, pids))
                stock.append(await asyncio.to_thread(run_stock, socket, hub))
    ours_per_s = statistics.median(run.cycles_per_s for run in ours)
    stock_per_s = statistics.median(run.cycles_per_s for run in stock)
    facts = {
        "ours_per_s": [run.cycles_per_s for run in ours],
        "stock_per_s": [run.cycles_per_s for run in stock],
        "ours_processor_us_per_cycle": _medians(ours),
        "stock_processor_us_per_cycle": _medians(stock),
    }
    return Section(
        "lockstep",
        facts,
        [
            Ratio("lockstep, cycles a second", ours_per_s, 1.0, "1/s", 4000.0),
            Ratio("lockstep, ours / stock canopen", ours_per_s, stock_per_s, "1/s", 5.0),
        ],
        [],
    )


@contextlib.contextmanager
def _ready(command: list[str]) -> Iterator[subprocess.Popen[str]]:
    """A process that has printed its first line; killed if it is still there at the end."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            line = process.stdout.readline() if process.stdout else ""
            if process.poll() is not None:
                raise RuntimeError(f"{' '.join(command)} did not start: {line.strip()}")
            yield process
        finally:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(2.0)
            process.kill()


def _role(pid: int) -> str:
    command = command_line(pid)
    return "hub" if "local_can" in command else "simulator" if "hil-sim" in command else command


def _per_cycle(spent_s: dict[str, float], cycles: int) -> dict[str, float]:
    return {role: 1e6 * seconds / cycles for role, seconds in spent_s.items()}


def _medians(runs: list[Run]) -> dict[str, Any]:
    roles = runs[0].processor_us
    return {role: statistics.median(run.processor_us.get(role, 0.0) for run in runs) for role in roles}
