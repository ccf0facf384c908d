"""Long runs in real time: simulator, controller, and its page drawn by a Chromium without a screen.

Run as `python -m tests.campaigns.bench.real_time_main --json FILE --minutes 10 --runs 10`. Each run makes
circles at 1 kHz and records them, under SCHED_OTHER and SCHED_FIFO in turn; `cyclictest` measures the same
computer for a minute right after it, with the browser still there. The file is written after each run; called
again, the program goes on behind the last one in it.
"""

import asyncio
import itertools
import json
import os
import sys
import tempfile
from collections import Counter
from collections.abc import AsyncIterator, Callable, Iterable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer
from rich.console import Console
from rich.table import Table

from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.daemon.cycle.realtime import RealtimeError
from servo_ctrl.daemon.page.page_process import PageOptions, kept_running
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.hil_rig.simulated_machine import SimulatorError, simulated_machine
from tests.campaigns.bench import cyclictest
from tests.campaigns.bench.main import machine_facts, write_whole
from tests.campaigns.bench.process_time import stolen_s
from tests.campaigns.bench.scope_browser import opened_browser
from tests.campaigns.bench.tick_lateness import (
    LATE_AIM,
    MACHINE,
    MISSED_AIM,
    POLICIES,
    PROGRAM,
    SHARES,
    Ticks,
)
from tests.support.free_port import free_tcp_port

TURN_S = 3.14
"""Time of one circle of the program."""
YARDSTICK_S = 60.0
RATIO_AIM = 2.0
"""Bounds the 99th percentile of the lateness in those of `cyclictest`."""
SETTLED_S = 15.0
"""Time until page and browser have started: their start is not what is measured."""


class Run(NamedTuple):
    """One run, and `cyclictest` after it: lateness in us -> ticks."""

    policy: str
    ticks: Ticks
    yardstick: Counter[int]
    reason: str
    """Why it stopped early; "" when it did not."""
    stolen_s: float
    """Processor time that the host of a virtual machine took away meanwhile."""

    def as_json(self) -> dict[str, Any]:
        """Return the figures, and which aims they meet."""
        late_us = {name: cyclictest.percentile_us(self.yardstick, share) for name, share in SHARES.items()}
        figures = self.ticks.as_json()
        ratio = figures["lateness_us"]["p99"] / max(late_us["p99"], 1.0)
        met = {
            "no stop": not self.reason,
            "missed": self.ticks.missed_of_10000 <= MISSED_AIM,
            "late inputs": self.ticks.late_percent <= LATE_AIM,
            "p99": ratio <= RATIO_AIM,
        }
        return {
            "policy": self.policy,
            **figures,
            "cyclictest_us": late_us,
            "p99_ratio": ratio,
            "reason": self.reason,
            "stolen_s": self.stolen_s,
            "met": met,
        }


def runs_to_make(made: list[dict[str, Any]], runs: int) -> Iterator[str]:
    """Yield the policies of the runs that are left to make: each in turn, without those made."""
    kept = Counter(run["policy"] for run in made)
    for policy in itertools.islice(itertools.cycle(POLICIES), runs):
        if kept[policy]:
            kept[policy] -= 1
        else:
            yield policy


async def measure(
    policies: Iterable[str], minutes: float, progress: Callable[[str], None]
) -> AsyncIterator[dict[str, Any]]:
    """Make a run of each policy; yield its figures. A policy that is not permitted is left out."""
    for policy in policies:
        progress(f"{policy}: {minutes:g} min and one of cyclictest")
        started, load = datetime.now(UTC).isoformat(timespec="seconds"), os.getloadavg()[0]
        try:
            run = await _run(policy, minutes, fifo=POLICIES[policy])
        except (RealtimeError, SimulatorError) as error:
            progress(f"{policy}: {error}")
            continue
        yield {"started": started, "load_before": load, **run.as_json()}


async def _run(policy: str, minutes: float, *, fifo: bool) -> Run:
    address = f"127.0.0.1:{free_tcp_port()}"
    with tempfile.TemporaryDirectory(prefix="bench-") as name:
        folder = Path(name)
        machine, program = load_machine(MACHINE), folder / "circles.toml"
        turns = max(round(minutes * 60.0 / TURN_S), 1)
        program.write_text(PROGRAM.read_text(encoding="utf-8").replace("turns = 1.5", f"turns = {turns}"))
        link = folder / "page.sock"

        def on_socket(path: Path) -> None:
            link.unlink(missing_ok=True)
            link.symlink_to(path)

        page = [sys.executable, "-m", "servo_ctrl.hmi", "serve", "--socket", str(link), "--listen", address]
        async with (
            kept_running([*page, "--recordings", str(folder)], print),
            opened_browser(address, folder),
            simulated_machine(MACHINE, "realtime", fifo=fifo) as bus,
        ):
            await asyncio.sleep(SETTLED_S)
            stolen_before_s = stolen_s()
            report = await run_machine(
                machine,
                load_program(program, machine),
                bus,
                "realtime",
                folder / "recording",
                fifo=fifo,
                page=PageOptions(None, on_socket),
            )
            taken_s = stolen_s() - stolen_before_s
            period_us = machine.bus.sync_period_us
            loops = round(YARDSTICK_S * 1e6 / period_us)
            yardstick = await asyncio.to_thread(cyclictest.run, loops, period_us, fifo=fifo)
    return Run(policy, Ticks.of(report), yardstick, report.reason, taken_s)


def table_of(runs: list[dict[str, Any]]) -> Table:
    """Return a row a run; what misses its aim is red."""
    table = Table(
        "policy",
        "ticks",
        "missed of 10,000",
        "late inputs, %",
        "p99, us",
        "of cyclictest",
        "stopped",
        "taken by the host, ms",
    )
    for run in runs:
        cells = {
            "missed": f"{run['missed_of_10000']:.1f}",
            "late inputs": f"{run['late_percent']:.3f}",
            "p99": f"{run['p99_ratio']:.2f}",
            "no stop": "yes" if run["reason"] else "no",
        }
        shown = {key: text if run["met"][key] else f"[red]{text}[/]" for key, text in cells.items()}
        p99_us = f"{run['lateness_us']['p99']:.0f}"
        table.add_row(
            *(run["policy"], f"{run['ticks']}", shown["missed"], shown["late inputs"], p99_us),
            *(shown["p99"], shown["no stop"], f"{run['stolen_s'] * 1e3:.0f}"),
        )
    return table


def kept_runs(json_file: Path, minutes: float, machine: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the runs of an earlier call; [] without a file. Runs of other conditions are refused."""
    if not json_file.exists():
        return []
    try:
        kept = json.loads(json_file.read_text(encoding="utf-8"))
        runs, conditions = kept["runs"], (kept["minutes"], kept["machine"])
    except (ValueError, KeyError, TypeError) as error:
        raise typer.BadParameter(f"{json_file} is no file of this benchmark: {error}") from error
    if conditions != (minutes, machine):
        raise typer.BadParameter(f"{json_file} has runs of another length or computer: name another file")
    return list(runs)


def main(
    json_file: Annotated[Path, typer.Option("--json", help="Where the figures go; its runs are kept.")],
    minutes: Annotated[float, typer.Option(min=0.1, help="Of each run.")] = 10.0,
    runs: Annotated[int, typer.Option(min=1, help="Runs in the file, under both policies in turn.")] = 10,
) -> None:
    """Measure until the file has all runs; it is written whole after each. Print a table."""
    console, machine = Console(), machine_facts()
    made = kept_runs(json_file, minutes, machine)

    async def add_runs() -> None:
        async for run in measure(list(runs_to_make(made, runs)), minutes, console.print):
            made.append(run)
            kept = {"machine": machine, "minutes": minutes, "runs": made}
            write_whole(json_file, json.dumps(kept, indent=2) + "\n")
            end = run["reason"] or "done"
            console.print(
                f"{run['ticks']} ticks, {run['missed']} missed, {run['late_cycles']} with late inputs; {end}"
            )

    try:
        asyncio.run(add_runs())
    except KeyboardInterrupt:
        console.print("interrupted; call again to go on")
    console.print(table_of(made))
    for number, run in enumerate(made, 1):
        if run["reason"]:
            console.print(f"run {number}, {run['policy']}, stopped: {run['reason']}")
    console.print(f"{len(made)} of {runs} runs in {json_file}")


if __name__ == "__main__":
    typer.run(main)
