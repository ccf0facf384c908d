"""`make soak`: a simulated week in lockstep and an hour in real time, to find growth, leaks and drift.

Run as `python -m tests.campaigns.endurance.soak_main --json soak.json --simulated-hours 168 --real-minutes
60`. The week uses `csp_table`, whose drives close the loops, at a cycle of 100 ms; the hour uses
machines/xy_table. Both consist of runs of `--run-minutes`; each finished run is a line in `progress.jsonl`,
from which an interrupted soak continues. The exit status is 1 if counts disagreed, or if anything leaked or
grew.
"""

import asyncio
import contextlib
import json
import os
import time
from collections.abc import AsyncIterator, Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer
from rich.console import Console

from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.run.report import Pacing
from servo_ctrl.errors import ServoCtrlError
from tests.campaigns.bench.awake import undisturbed
from tests.campaigns.bench.main import machine_facts, write_whole
from tests.campaigns.endurance.growth import top_growth
from tests.campaigns.endurance.rig import (
    CSP_TABLE,
    MACHINE,
    PERIOD_US,
    Rig,
    Station,
    fifo_is_permitted,
    rig,
    station,
    table_at,
)
from tests.campaigns.endurance.soak import RunOutcome, Soak, leaks
from tests.campaigns.endurance.soak_summary import ProgressLine, progress_line, read_lines, summary

WEEK_H = 168.0
PROGRESS = "progress.jsonl"
REFUSED_RUNS_MAX = 20
"""Tolerated runs that do not begin in real time: a node without processor time responds too late; chosen."""


class Part(NamedTuple):
    """A part of a soak: `target_s` of machine time of the machine in `folder`."""

    pacing: Pacing
    target_s: float
    folder: Path
    machine: MachineConfig


class Production:
    """Makes runs of one pacing until `target_s` of machine time are done, a line of `progress.jsonl` each."""

    def __init__(
        self,
        soak: Soak,
        session: str,
        target_s: float,
        run_s: float,
        progress_file: Path,
        done: list[ProgressLine],
    ) -> None:
        self.lines = list(done)
        self.outcomes: list[RunOutcome] = []
        """The first and the last of this session."""
        self.stop_signal = ""
        """The signal that ended the soak; "" = none."""
        self._soak, self._session, self._target_s, self._run_s = soak, session, target_s, run_s
        self._file = progress_file

    @property
    def remaining_s(self) -> float:
        """Remaining machine time; 0 after a stop signal."""
        remaining_s = self._target_s - sum(line["machine_s"] for line in self.lines)
        return 0.0 if self.stop_signal or remaining_s < 1.0 else remaining_s

    async def until_stopped(self, progress: Callable[[str], None]) -> None:
        """Make runs on one rig until one is stopped, which leaves the table anywhere.

        Raises ServoCtrlError if a run does not begin.
        """
        stop_reason = ""
        while self.remaining_s and not stop_reason:
            outcome = await self._soak.run(min(self._run_s, self.remaining_s))
            if outcome.report.signal:
                self.stop_signal = outcome.report.signal
                progress(f"{self._soak.pacing}: ended by {self.stop_signal}; finished runs are kept")
                return
            stop_reason = outcome.stop_reason
            progress(f"{self._soak.pacing}: {self._record(outcome)}")

    def _record(self, outcome: RunOutcome) -> str:
        line = progress_line(self._session, self._soak, outcome)
        with self._file.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
        self.lines.append(line)
        self.outcomes = [*self.outcomes[:1], outcome._replace(samples=())]
        done_h, target_h = (self._target_s - self.remaining_s) / 3600.0, self._target_s / 3600.0
        speed = line["machine_s"] / line["wall_s"]
        remarks = "".join(f"; {text}" for text in (line["stopped"], *line["faults"]) if text)
        return f"{done_h:.3f} h of {target_h:g} h, {speed:.2f} times real time{remarks}"


async def run_part(
    part: Part,
    run_s: float,
    folder: Path,
    earlier: list[ProgressLine],
    progress: Callable[[str], None],
    *,
    traced: bool = False,
) -> tuple[list[ProgressLine], list[str], list[str]]:
    """Run until `part` is done, continuing from the lines `earlier`; return all lines, leaks and growth.

    In real time a busy computer may cause a stop by the fault policy. The stop is counted, and the next run
    begins on a new rig with home at the position of the table.
    """
    pacing = part.pacing
    realtime = pacing == "realtime"
    session = f"{datetime.now(UTC):%Y%m%dT%H%M%S}-{os.getpid()}"
    runs = folder / f"{pacing}-{session}"
    runs.mkdir(parents=True)
    soak = Soak(part.machine, runs, pacing, fifo=realtime and fifo_is_permitted())
    part_key = (pacing, part.machine.machine.name)
    done = [line for line in earlier if (line["pacing"], line.get("machine")) == part_key]
    production = Production(soak, session, part.target_s, run_s, folder / PROGRESS, done)
    refused_runs = 0
    while production.remaining_s:
        try:
            async with observed_rig(part) as (table, observer):
                soak.use_rig(table, observer)
                await production.until_stopped(progress)
        except ServoCtrlError as error:
            progress(f"{pacing}: {error}")
            refused_runs += 1
            if not realtime or refused_runs > REFUSED_RUNS_MAX:
                raise
    growth: list[str] = []
    if traced and not production.stop_signal:
        progress(f"{pacing}: growth by tracemalloc")
        async with observed_rig(part) as (table, observer):
            soak.use_rig(table, observer)
            growth = await top_growth(lambda: soak.run(min(run_s, 60.0)))
    return production.lines, leaks(production.outcomes), growth


@contextlib.asynccontextmanager
async def observed_rig(part: Part) -> AsyncIterator[tuple[Rig, Station]]:
    """Start a rig and its counting station; in real time with priority on the processor."""
    async with (
        contextlib.AsyncExitStack() as awake,
        rig(part.pacing, machine=part.folder) as table,
        station("counting_station", str(table.socket)) as observer,
    ):
        if part.pacing == "realtime":
            awake.enter_context(undisturbed())
        yield table, observer


def main(
    json_file: Annotated[Path, typer.Option("--json", help="File for the figures.")],
    simulated_hours: Annotated[float, typer.Option(help="Machine time in lockstep, hours.")] = WEEK_H,
    real_minutes: Annotated[float, typer.Option(help="Machine time in real time, minutes.")] = 60.0,
    simulated_machine: Annotated[
        Path, typer.Option(help="Machine in lockstep; of machines/xy_table, at 1 kHz, a week takes 22 h.")
    ] = CSP_TABLE,
    run_minutes: Annotated[float, typer.Option(help="Machine time of one run, minutes.")] = 30.0,
    period_us: Annotated[int, typer.Option(help="SYNC period of the table in real time.")] = PERIOD_US,
    folder: Annotated[Path, typer.Option(help="Recordings and progress.")] = Path("out/soak"),
    fresh: Annotated[bool, typer.Option("--fresh", help="Forget what an earlier soak has done.")] = False,
    traced: Annotated[bool, typer.Option("--trace", help="Name what grows, by tracemalloc.")] = False,
) -> None:
    """Soak, print the results, and write the JSON file."""
    console = Console()
    folder.mkdir(parents=True, exist_ok=True)
    if fresh:
        (folder / PROGRESS).unlink(missing_ok=True)
    earlier = read_lines(folder / PROGRESS)
    started, start_s = datetime.now(UTC), time.monotonic()
    result: dict[str, Any] = {
        "started": started.isoformat(timespec="seconds"),
        "machine": {**machine_facts(), "load_before": os.getloadavg()[0]},
    }
    faults = []
    for part in (
        Part("lockstep", simulated_hours * 3600.0, simulated_machine, load_machine(simulated_machine)),
        Part("realtime", real_minutes * 60.0, MACHINE, table_at(period_us)),
    ):
        pacing = part.pacing
        if part.target_s <= 0.0:
            continue
        lines, leaked, growth = asyncio.run(
            run_part(part, run_minutes * 60.0, folder, earlier, console.print, traced=traced)
        )
        result[pacing] = {**summary(lines), "leaked": leaked, "grown": growth}
        faults += [f"{pacing}: {text}" for text in (*leaked, *result[pacing]["faults"])]
        faults += [
            f"{pacing}: memory of the {role} grows"
            for role, growth_of_role in result[pacing]["memory_mib_per_h"].items()
            if growth_of_role["verdict"] == "grows"
        ]
        if result[pacing]["machine_h"] * 3600.0 < part.target_s - 1.0:
            break  # a signal ended the soak
    result["duration_s"] = round(time.monotonic() - start_s, 1)
    result["faults"] = faults
    write_whole(json_file, json.dumps(result, indent=2) + "\n")
    console.print_json(data={key: result[key] for key in ("lockstep", "realtime") if key in result})
    for text in faults:
        console.print(f"[red]{text}[/]")
    console.print(f"{result['duration_s']} s; written to {json_file}")
    if faults:
        raise typer.Exit(1)


if __name__ == "__main__":
    typer.run(main)
