"""Long runs in real time: simulator, controller, and its page drawn by a Chromium without a screen.

Run as `python -m tests.campaigns.bench.real_time_main --json FILE --minutes 10 --runs 10`. Each run makes
circles at 1 kHz and records them, under SCHED_OTHER and SCHED_FIFO in turn; `cyclictest` measures the same
computer for a minute right after it, with the browser still there.
"""

import asyncio
import contextlib
import itertools
import json
import os
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import AsyncIterator, Callable
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
from tests.campaigns.bench.tick_lateness import (
    LATE_AIM,
    MACHINE,
    MISSED_AIM,
    POLICIES,
    PROGRAM,
    SHARES,
    Ticks,
)
from tests.support.browser_program import CHROMIUM
from tests.support.free_port import free_tcp_port

TURN_S = 3.14
"""Time of one circle of the program."""
YARDSTICK_S = 60.0
RATIO_AIM = 2.0
"""Bounds the 99th percentile of the lateness in those of `cyclictest`."""
GIVE_WAY = ("sh", "-c", 'echo 19 > /proc/self/autogroup; exec "$0" "$@"')
"""Starts a program that gives way: Linux shares processors among sessions first, without `nice`; sched(7)."""
SETTLED_S = 15.0
"""Time until page and browser have started: their start is not what is measured."""
BROWSER = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking"),
    *("--no-first-run", "--remote-debugging-port=0"),
)


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


async def measure(minutes: float, runs: int, progress: Callable[[str], None]) -> list[Run]:
    """Make the runs, under each policy in turn. A policy that is not permitted is left out."""
    made: list[Run] = []
    for number, (policy, fifo) in itertools.islice(enumerate(itertools.cycle(POLICIES.items())), runs):
        progress(f"{policy}, run {number + 1} of {runs}, {minutes:g} min and one of cyclictest")
        try:
            run = await _run(policy, minutes, fifo=fifo)
        except (RealtimeError, SimulatorError) as error:
            progress(f"{policy}: {error}")
            continue
        made.append(run)
        missed, late = run.ticks.missed, run.ticks.late_cycles
        end = run.reason or "done"
        progress(f"{run.ticks.served} ticks, {missed} missed, {late} with late inputs; {end}")
    return made


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
            _browser(address, folder),
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


@contextlib.asynccontextmanager
async def _browser(address: str, folder: Path) -> AsyncIterator[None]:
    """A browser with the Scope page, opened as soon as this is served: its start stalls a small computer."""
    if CHROMIUM is None:
        raise typer.BadParameter("there is no Chromium; install Debian's chromium-headless-shell")
    opening = asyncio.create_task(_open(CHROMIUM, address, folder))
    try:
        yield
    finally:
        opening.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await opening


async def _open(program: str, address: str, folder: Path) -> None:
    host, port = address.split(":")
    while True:
        try:
            _, writer = await asyncio.open_connection(host, int(port))
        except OSError:
            await asyncio.sleep(0.2)
            continue
        writer.close()
        break
    browser = await asyncio.create_subprocess_exec(
        *(*GIVE_WAY, program, *BROWSER, f"--user-data-dir={folder / 'browser'}", f"http://{address}/scope"),
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.DEVNULL,
        start_new_session=True,  # Debian's program is a script that starts the browser
    )
    try:
        await browser.wait()
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(browser.pid, signal.SIGKILL)
        await browser.wait()


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


def main(
    json_file: Annotated[Path, typer.Option("--json", help="Where the figures go.")],
    minutes: Annotated[float, typer.Option(min=0.1, help="Of each run.")] = 10.0,
    runs: Annotated[int, typer.Option(min=1, help="Runs, under both policies in turn.")] = 10,
) -> None:
    """Measure, print a table, write the JSON file whole."""
    console = Console()
    started, load = datetime.now(UTC), os.getloadavg()[0]
    begun_s = time.monotonic()
    made = [run.as_json() for run in asyncio.run(measure(minutes, runs, console.print))]
    result = {
        "started": started.isoformat(timespec="seconds"),
        "duration_s": round(time.monotonic() - begun_s, 1),
        "machine": {**machine_facts(), "load_before": load},
        "minutes": minutes,
        "runs": made,
    }
    write_whole(json_file, json.dumps(result, indent=2) + "\n")
    console.print(table_of(made))
    for run in made:
        if run["reason"]:
            console.print(f"{run['policy']} stopped: {run['reason']}")
    console.print(f"written to {json_file}")


if __name__ == "__main__":
    typer.run(main)
