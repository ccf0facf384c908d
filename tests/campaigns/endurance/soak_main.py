"""`make soak`: a simulated week in lockstep and an hour in real time; what grows, what leaks, what drifts.

Run as `python -m tests.campaigns.endurance.soak_main --json soak.json --simulated-hours 168 --real-minutes
60`. The week is that of `csp_table`, whose drives close the loops, at a cycle of 100 ms; the hour that of
machines/xy_table. It is made of runs of `--run-minutes`; each finished run is a line in `progress.jsonl`, and
a soak that was ended goes on from there. Exit status 1 where anything did not agree, leaked or grew.
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
from tests.campaigns.endurance.soak_books import Line, line_of, read_lines, summary

WEEK_H = 168.0
PROGRESS = "progress.jsonl"
REFUSED_AT_MOST = 20
"""Runs that do not begin, in real time: a node that gets no processor answers too late."""


class Part(NamedTuple):
    """What is to be run: `wanted_s` of machine time of the machine in `folder`."""

    pacing: Pacing
    wanted_s: float
    folder: Path
    machine: MachineConfig


class Production:
    """Runs of one pacing until `wanted_s` of machine time are done; each is a line of `progress.jsonl`."""

    def __init__(
        self, soak: Soak, session: str, wanted_s: float, run_s: float, progress_file: Path, done: list[Line]
    ) -> None:
        self.lines = list(done)
        self.outcomes: list[RunOutcome] = []
        """The first and the last of this session."""
        self.ended_by = ""
        """The signal that somebody has ended it with."""
        self._soak, self._session, self._wanted_s, self._run_s = soak, session, wanted_s, run_s
        self._file = progress_file

    @property
    def left_s(self) -> float:
        """Machine time that is wanted still; 0 where somebody has ended it."""
        left_s = self._wanted_s - sum(line["machine_s"] for line in self.lines)
        return 0.0 if self.ended_by or left_s < 1.0 else left_s

    async def until_stopped(self, progress: Callable[[str], None]) -> None:
        """Runs on one rig until one is stopped: that one leaves the table anywhere. Raises ServoCtrlError
        where a run does not begin.
        """
        stopped = ""
        while self.left_s and not stopped:
            outcome = await self._soak.run(min(self._run_s, self.left_s))
            if outcome.report.signal:
                self.ended_by = outcome.report.signal
                progress(f"{self._soak.pacing}: ended by {self.ended_by}; what was finished is kept")
                return
            stopped = outcome.stopped
            progress(f"{self._soak.pacing}: {self._keep(outcome)}")

    def _keep(self, outcome: RunOutcome) -> str:
        line = line_of(self._session, self._soak, outcome)
        with self._file.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
        self.lines.append(line)
        self.outcomes = [*self.outcomes[:1], outcome._replace(samples=())]
        done_h, wanted_h = (self._wanted_s - self.left_s) / 3600.0, self._wanted_s / 3600.0
        speed = line["machine_s"] / line["wall_s"]
        words = "".join(f"; {text}" for text in (line["stopped"], *line["faults"]) if text)
        return f"{done_h:.3f} h of {wanted_h:g} h, {speed:.2f} times real time{words}"


async def soaked(
    part: Part,
    run_s: float,
    folder: Path,
    before: list[Line],
    progress: Callable[[str], None],
    *,
    traced: bool = False,
) -> tuple[list[Line], list[str], list[str]]:
    """Run until `part` is done, with what was done `before`; all lines, leaks, what grew.

    In real time a stop by the policy, because the computer is busy, is counted, and the next run begins on
    a new rig: its home is where the table is found.
    """
    pacing = part.pacing
    realtime = pacing == "realtime"
    session = f"{datetime.now(UTC):%Y%m%dT%H%M%S}-{os.getpid()}"
    runs = folder / f"{pacing}-{session}"
    runs.mkdir(parents=True)
    soak = Soak(part.machine, runs, pacing, fifo=realtime and fifo_is_permitted())
    ours = (pacing, part.machine.machine.name)
    done = [line for line in before if (line["pacing"], line.get("machine")) == ours]
    production = Production(soak, session, part.wanted_s, run_s, folder / PROGRESS, done)
    refused = 0
    while production.left_s:
        try:
            async with bench(part) as (table, witness):
                soak.stand_on(table, witness)
                await production.until_stopped(progress)
        except ServoCtrlError as error:
            progress(f"{pacing}: {error}")
            refused += 1
            if not realtime or refused > REFUSED_AT_MOST:
                raise
    grown: list[str] = []
    if traced and not production.ended_by:
        progress(f"{pacing}: what grows, by tracemalloc")
        async with bench(part) as (table, witness):
            soak.stand_on(table, witness)
            grown = await top_growth(lambda: soak.run(min(run_s, 60.0)))
    return production.lines, leaks(production.outcomes), grown


@contextlib.asynccontextmanager
async def bench(part: Part) -> AsyncIterator[tuple[Rig, Station]]:
    """A rig and who counts on it; in real time with the processor before others."""
    async with (
        contextlib.AsyncExitStack() as awake,
        rig(part.pacing, machine=part.folder) as table,
        station("counting_station", str(table.socket)) as witness,
    ):
        if part.pacing == "realtime":
            awake.enter_context(undisturbed())
        yield table, witness


def main(
    json_file: Annotated[Path, typer.Option("--json", help="Where the figures go.")],
    simulated_hours: Annotated[float, typer.Option(help="Machine time in lockstep, hours.")] = WEEK_H,
    real_minutes: Annotated[float, typer.Option(help="Machine time in real time, minutes.")] = 60.0,
    simulated_machine: Annotated[
        Path,
        typer.Option(help="Machine in lockstep; of machines/xy_table, at 1 kHz, a week takes 22 h."),
    ] = CSP_TABLE,
    run_minutes: Annotated[float, typer.Option(help="Machine time of one run, minutes.")] = 30.0,
    period_us: Annotated[int, typer.Option(help="SYNC period of the table in real time.")] = PERIOD_US,
    folder: Annotated[Path, typer.Option(help="Recordings and progress.")] = Path("out/soak"),
    fresh: Annotated[bool, typer.Option("--fresh", help="Forget what an earlier soak has done.")] = False,
    traced: Annotated[bool, typer.Option("--trace", help="Name what grows, by tracemalloc.")] = False,
) -> None:
    """Soak, print, write the JSON file whole."""
    console = Console()
    folder.mkdir(parents=True, exist_ok=True)
    if fresh:
        (folder / PROGRESS).unlink(missing_ok=True)
    before = read_lines(folder / PROGRESS)
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
        if part.wanted_s <= 0.0:
            continue
        lines, leaked, grown = asyncio.run(
            soaked(part, run_minutes * 60.0, folder, before, console.print, traced=traced)
        )
        result[pacing] = {**summary(lines), "leaked": leaked, "grown": grown}
        faults += [f"{pacing}: {text}" for text in (*leaked, *result[pacing]["faults"])]
        faults += [
            f"{pacing}: memory of the {role} grows"
            for role, found in result[pacing]["memory_mib_per_h"].items()
            if found["verdict"] == "grows"
        ]
        if result[pacing]["machine_h"] * 3600.0 < part.wanted_s - 1.0:
            break  # somebody has ended it
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
