"""Where a cycle's microseconds go: controller and simulator in one process, each part timed around its calls.

    python -m tests.campaigns.bench.cycle_parts --json docs/tables/cycle_parts.json --label "what it was"

A run of `circle.toml` in lockstep over localcan. A part is what a function takes without the parts that it
calls; what the clock itself takes is measured before, and left out. Each figure is the median over the
cycles, which a busy computer moves little. The JSON keeps what was measured under other labels before, and
`cycle_parts_picture` draws it.
"""

import asyncio
import importlib
import json
import statistics
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from functools import partial, wraps
from pathlib import Path
from typing import Annotated, Any

import typer

from hil_sim.config import load_plant
from hil_sim.runner.can_port import CanPort, open_bus
from hil_sim.runner.process import serve
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.daemon.run import supervisor
from servo_ctrl.io.can_port import open_port
from tests.campaigns.bench.main import machine_facts

HERE = Path(__file__).parent
MACHINE = HERE.parents[2] / "machines" / "xy_table"
PROGRAM = HERE / "circle.toml"
SIMULATOR, CONTROLLER = "simulator", "controller"
NEW_CYCLE = "servo_ctrl.daemon.cycle.cycle:Cycle.begin"
PARTS: tuple[tuple[str, str, str], ...] = (
    (CONTROLLER, "frames taken", "servo_ctrl.io.can_port:CanPort._drain"),
    (CONTROLLER, "frames taken", "servo_ctrl.daemon.cycle.cycle:Cycle._complete"),
    (CONTROLLER, "machine", "servo_ctrl.daemon.cycle.machine:MachineController.tick"),
    (CONTROLLER, "next row", "servo_ctrl.daemon.set_points.set_point_source:SetPointSource.follow"),
    (CONTROLLER, "bytes in and out", "servo_ctrl.axis.cycle_memory:CycleMemory.step"),
    (CONTROLLER, "bytes in and out", "servo_ctrl.axis.cycle_memory:CycleMemory.payloads"),
    (CONTROLLER, "compiled axes", "servo_ctrl.axis.cycle_memory:ready_for"),
    (CONTROLLER, "row observed", "servo_ctrl.daemon.cycle.rows:RowRouter.take"),
    (CONTROLLER, "SYNC, own node", NEW_CYCLE),
    (CONTROLLER, "frames sent", "servo_ctrl.io.can_port:CanPort.flush"),
    ("", "bus", "local_can.bus:LocalCanBus.receive_burst"),
    ("", "bus", "local_can.bus:LocalCanBus.send_burst"),
    (SIMULATOR, "frames taken", "hil_sim.runner.can_port:CanPort.drain"),
    (SIMULATOR, "bytes in and out", "hil_sim.runner.bench:SimulatedMachine.take"),
    (SIMULATOR, "bytes in and out", "hil_sim.runner.burst_server:BurstServer.serve"),
    (SIMULATOR, "compiled nodes and plant", "hil_sim.runner.burst_server:ready_for"),
    (SIMULATOR, "timers", "hil_sim.runner.bench:SimulatedMachine.run_timers"),
    (SIMULATOR, "frames sent", "hil_sim.runner.can_port:CanPort.flush"),
)
"""Side, part, and the function that it is timed around. The bus' side is whose end it is."""
MAKER = "ready_for"
"""What makes a compiled call, which then is what is timed."""

Figures = dict[str, dict[str, float]]


class PartsClock:
    """Times functions around their calls, one cycle after the other."""

    def __init__(self) -> None:
        self.cycles: list[dict[tuple[str, str], int]] = []
        self._spent: dict[tuple[str, str], int] = defaultdict(int)
        self._inner: list[int] = []
        """Of each function that has not returned: what those have taken that it called."""
        self._inside_ns = self._around_ns = 0
        self._calibrate()

    def timed(self, key: tuple[str, str], function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, timed."""

        @wraps(function)
        def call(*arguments: Any, **named: Any) -> Any:
            self._inner.append(0)
            began_ns = time.perf_counter_ns()
            try:
                return function(*arguments, **named)
            finally:
                taken_ns = time.perf_counter_ns() - began_ns
                side = key[0] or (SIMULATOR if arguments[0].serves else CONTROLLER)
                self._spent[side, key[1]] += taken_ns - self._inner.pop() - self._inside_ns
                if self._inner:
                    self._inner[-1] += taken_ns + self._around_ns

        return call

    def next_cycle(self) -> None:
        """What comes from now on belongs to the next cycle."""
        self.cycles.append(dict(self._spent))
        self._spent.clear()

    def _calibrate(self) -> None:
        """Take what the clock reads around nothing, and what it takes beyond; the least of many."""
        empty, calls = self.timed(("", "nothing"), lambda _self: None), 500
        end = type("End", (), {"serves": True})()
        inside_ns, whole_ns = [], []
        for _ in range(100):
            began_ns = time.perf_counter_ns()
            for _ in range(calls):
                empty(end)
            whole_ns.append((time.perf_counter_ns() - began_ns) // calls)
            inside_ns.append(self._spent.pop((SIMULATOR, "nothing")) // calls)
        self._inside_ns = min(inside_ns)
        self._around_ns = min(whole_ns) - self._inside_ns

    def figures(self) -> Figures:
        """Medians over the cycles, microseconds, by side and part; the first tenth has other work."""
        cycles = self.cycles[len(self.cycles) // 10 :]
        figures: Figures = {CONTROLLER: {}, SIMULATOR: {}}
        for side, part in dict.fromkeys((side, part) for cycle in cycles for side, part in cycle):
            taken_ns = statistics.median(cycle.get((side, part), 0) for cycle in cycles)
            figures[side][part] = round(taken_ns / 1e3, 1)
        return {side: {part: us for part, us in parts.items() if us} for side, parts in figures.items()}


def place_of(path: str) -> tuple[Any, str]:
    """The module or class that holds a function, and its name there."""
    module, _, names = path.partition(":")
    *outer, name = names.split(".")
    holder: Any = importlib.import_module(module)
    for part in outer:
        holder = getattr(holder, part)
    return holder, name


def take_apart(clock: PartsClock) -> None:
    """Time every part of `PARTS` from now on."""
    for side, part, path in PARTS:
        holder, name = place_of(path)
        function = getattr(holder, name)
        timed = partial(clock.timed, (side, part))
        setattr(holder, name, maker_of_timed(timed, function) if name == MAKER else timed(function))
    holder, name = place_of(NEW_CYCLE)
    begin = getattr(holder, name)

    def next_cycle(*arguments: Any) -> None:
        clock.next_cycle()
        begin(*arguments)

    setattr(holder, name, next_cycle)


def maker_of_timed(
    timed: Callable[[Callable[..., Any]], Callable[..., Any]], maker: Callable[..., Callable[..., Any]]
) -> Callable[..., Callable[..., Any]]:
    """What makes the same calls as `maker`, each of them timed."""
    return lambda *arguments: timed(maker(*arguments))


async def run() -> None:
    """One circle, both sides in this loop."""
    machine = load_machine(MACHINE)
    with tempfile.TemporaryDirectory(prefix="parts-") as folder:
        bus, ready = f"localcan:{folder}/can.sock", asyncio.Event()
        served = asyncio.create_task(
            serve(
                load_plant(MACHINE),
                lambda: CanPort(open_bus(bus)),
                realtime=False,
                state_directory=None,
                on_ready=lambda _bench: ready.set(),
            )
        )
        await ready.wait()
        opened = await asyncio.to_thread(open_port, bus)  # the hub answers in this loop
        supervisor.open_port = lambda _bus: opened
        report = await supervisor.run_machine(machine, load_program(PROGRAM, machine), bus, "lockstep", None)
        served.cancel()
        if not report.completed:
            raise RuntimeError(f"the run did not complete: {report.reason}")


def main(
    json_file: Annotated[Path, typer.Option("--json", help="Where the figures go.")],
    label: Annotated[str, typer.Option(help="What was measured, e.g. a version.")],
) -> None:
    """Measure, print, and add to the JSON file."""
    clock = PartsClock()
    take_apart(clock)
    asyncio.run(run())
    figures = clock.figures()
    content = json.loads(json_file.read_text(encoding="utf-8")) if json_file.exists() else {}
    content[label] = {"us": figures, "cycles": len(clock.cycles), "machine": machine_facts()}
    json_file.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    for side, parts in figures.items():
        print(f"{side} {sum(parts.values()):.1f} us: {parts}")


if __name__ == "__main__":
    typer.run(main)
