"""Lockstep cycles a second with two axes and two scales on localcan, against the stock canopen exchange.

Ours: `hil-sim run`, which serves the bus, as a process, the daemon's `run_machine` in this one: boot,
enable, a circle, controlled stop, with control law, plant and all checks. Stock: the same seven frames a
cycle over a hub of its own, written with canopen's PDO objects and a Notifier on both ends
(`stock_canopen.py`), without a law and without a plant. Bare: the same frames as ready-made bytes on bare
sockets (`bare_exchange.py`), which is what the hub lets through. They take turns.
"""

import asyncio
import contextlib
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.daemon.run.report import Progress
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.hil_rig.simulated_machine import simulated_machine
from tests.campaigns.bench.outcome import Ratio, Section
from tests.campaigns.bench.process_time import children, command_line, processor_s

HERE = Path(__file__).parent
MACHINE = HERE.parents[2] / "machines" / "xy_table"
PROGRAM = HERE / "circle.toml"
STOCK, BARE = HERE / "stock_canopen.py", HERE / "bare_exchange.py"
REPEATS = 7
PEER_CYCLES = 3000
TIMEOUT_S = 60.0
FIRST_OF_BARE = 2000.0 / 8400.0
"""Cycles a second before the cycle was compiled, three processes and a frame a packet, of those of the bare
exchange through a hub in the same run; the best run of those in issue 21."""
PROCESSOR_AIM_US = 60.0


class Run(NamedTuple):
    """Cycles, the seconds they took, and processor microseconds a cycle by process, without the boot."""

    cycles: int
    wall_s: float
    processor_us: dict[str, float]

    @property
    def cycles_per_s(self) -> float:
        return self.cycles / self.wall_s


async def run_ours(bus: str, pids: dict[str, int]) -> Run:
    """One run of the circle on a bus where `hil-sim` is; `pids` are the other processes."""
    machine = load_machine(MACHINE)
    program = load_program(PROGRAM, machine)
    seen: list[tuple[int, dict[str, float]]] = []

    def look(progress: Progress) -> None:
        if progress.cycle:  # boot is over
            spent_s = {role: processor_s(pid) for role, pid in pids.items()}
            seen.append((progress.cycle, {**spent_s, "daemon": time.process_time()}))

    report = await run_machine(machine, program, bus, "lockstep", None, look)
    if not report.completed:
        raise RuntimeError(f"the run did not complete: {report.reason}")
    (first, before_s), (last, after_s) = seen[0], seen[-1]
    spent_us = {role: 1e6 * (after_s[role] - before_s[role]) / (last - first) for role in after_s}
    return Run(report.cycles, report.wall_s, spent_us)


def run_peer(script: Path, socket: Path, hub: int, cycles: int) -> Run:
    """One run of another exchange over the hub at `socket`, whose process id is `hub`."""
    with _ready([sys.executable, str(script), "devices", str(socket)]) as devices:
        hub_s = processor_s(hub)
        controller = subprocess.run(
            [sys.executable, str(script), "controller", str(socket), str(cycles)],
            capture_output=True,
            text=True,
            timeout=TIMEOUT_S,
            check=True,
        )
        spent_us = {"hub": 1e6 * (processor_s(hub) - hub_s) / cycles}
        devices.wait(TIMEOUT_S)
    return Run(cycles, cycles / float(controller.stdout), spent_us)


@contextlib.contextmanager
def peer_hub() -> Iterator[tuple[Path, int]]:
    """A hub of its own, run as ours is: its socket and its process id."""
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        socket = Path(folder) / "can.sock"
        with _ready([sys.executable, "-m", "local_can", str(socket), "--batch"]) as hub:
            yield socket, hub.pid
            hub.terminate()


def measure(progress: Callable[[str], None]) -> Section:
    """Both exchanges in turn."""
    return asyncio.run(_measure(progress))


async def _measure(progress: Callable[[str], None]) -> Section:
    ours: list[Run] = []
    stock: list[Run] = []
    bare: list[Run] = []
    async with simulated_machine(MACHINE, "lockstep") as bus:
        pids = {_role(pid): pid for pid in children()}
        with peer_hub() as (socket, hub):
            for repeat in range(REPEATS):
                progress(f"lockstep: repeat {repeat + 1} of {REPEATS}")
                ours.append(await run_ours(bus, pids))
                stock.append(await asyncio.to_thread(run_peer, STOCK, socket, hub, PEER_CYCLES))
                bare.append(await asyncio.to_thread(run_peer, BARE, socket, hub, PEER_CYCLES))
    kinds = {"ours": ours, "stock": stock, "bare": bare}
    facts: dict[str, Any] = {
        name: {
            "cycles_per_s": [run.cycles_per_s for run in runs],
            "processor_us_per_cycle": _medians([run.processor_us for run in runs]),
        }
        for name, runs in kinds.items()
    }
    per_s = {name: statistics.median(run.cycles_per_s for run in runs) for name, runs in kinds.items()}
    wall_s = statistics.median(run.wall_s for run in ours)
    return Section(
        "lockstep",
        facts,
        [
            Ratio("lockstep, cycles a second", ours[0].cycles, wall_s, "cycles", 4000.0, reference_unit="s"),
            Ratio("lockstep, ours / stock canopen", per_s["ours"], per_s["stock"], "1/s", 5.0),
            Ratio("lockstep, ours / bare sockets", per_s["ours"], per_s["bare"], "1/s", 1.0),
            Ratio(
                "lockstep, ours / bare, of what it was",
                *(per_s["ours"] / per_s["bare"], FIRST_OF_BARE, "of bare", 3.0),
            ),
            *(
                Ratio(
                    f"processor time a cycle, {role}, of its aim",
                    us,
                    PROCESSOR_AIM_US,
                    "us",
                    1.0,
                    at_most=True,
                )
                for role, us in facts["ours"]["processor_us_per_cycle"].items()
            ),
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


def _medians(spent_us: list[dict[str, float]]) -> dict[str, float]:
    return {role: statistics.median(run[role] for run in spent_us) for role in spent_us[0]}
