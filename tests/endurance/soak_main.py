"""`make soak`: a simulated week in lockstep and an hour in real time; what grows, what leaks, what drifts.

Run as `python -m tests.endurance.soak_main --json soak.json --simulated-hours 168 --real-minutes 60`. It is
made of runs of `--run-minutes`; each finished run is a line in `progress.jsonl`, and a soak that was ended
goes on from there. Exit status 1 where anything did not agree, leaked or grew.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

from servo_ctrl.config.errors import ServoCtrlError
from tests.bench.awake import favour_children, processors_awake
from tests.bench.main import machine_facts, write_whole
from tests.endurance.growth import top_growth
from tests.endurance.rig import PERIOD_US, fifo_is_permitted, rig, station, table_at
from tests.endurance.soak import Soak, leaks
from tests.endurance.soak_books import Line, line_of, read_lines, summary

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable

    from servo_ctrl.daemon.report import Pacing
    from tests.endurance.rig import Rig, Station

WEEK_H = 168.0
REFUSED_AT_MOST = 20
"""Runs that do not begin, in real time: a node that gets no processor answers too late."""


async def soaked(
    pacing: Pacing,
    wanted_s: float,
    run_s: float,
    period_us: int,
    folder: Path,
    done: list[Line],
    progress: Callable[[str], None],
    *,
    traced: bool = False,
) -> tuple[list[Line], list[str], list[str]]:
    """Run until `wanted_s` of machine time are done, `done` included; all lines, leaks, what grew.

    In real time a stop by the policy, because the computer is busy, is counted, and the next run begins on
    a new rig: a run that was stopped leaves the table anywhere, and its home is where it is found.
    """
    session = f"{datetime.now(UTC):%Y%m%dT%H%M%S}-{os.getpid()}"
    lines, outcomes, refused = list(done), [], 0
    realtime = pacing == "realtime"
    made = folder / f"{pacing}-{session}"
    made.mkdir(parents=True)
    soak = Soak(table_at(period_us), made, pacing, fifo=realtime and fifo_is_permitted())
    grown: list[str] = []
    interrupted = False
    while not interrupted and (left_s := wanted_s - sum(line["machine_s"] for line in lines)) > 1.0:
        async with bench(pacing) as (table, witness):
            soak.stand_on(table, witness)
            stopped = ""
            while not stopped and left_s > 1.0:
                try:
                    outcome = await soak.run(min(run_s, left_s))
                except ServoCtrlError as error:
                    stopped, refused = str(error), refused + 1
                    progress(f"{pacing}: {error}")
                    if not realtime or refused > REFUSED_AT_MOST:
                        raise
                    break
                if outcome.report.signal:
                    progress(f"{pacing}: ended by {outcome.report.signal}; what was finished is kept")
                    interrupted = True
                    break
                line = line_of(session, pacing, outcome, soak.recordings.bytes)
                with (folder / "progress.jsonl").open("a", encoding="utf-8") as file:
                    file.write(json.dumps(line) + "\n")
                lines.append(line)
                outcomes.append(outcome._replace(samples=()))
                del outcomes[1:-1]
                left_s, stopped = left_s - line["machine_s"], line["stopped"]
                progress(
                    f"{pacing}: {(wanted_s - left_s) / 3600.0:.3f} h of "
                    f"{wanted_s / 3600.0:g} h, {line['machine_s'] / line['wall_s']:.2f} times real time"
                    + "".join(f"; {text}" for text in (line["stopped"], *line["faults"]) if text)
                )
            if traced and left_s <= 1.0:
                progress(f"{pacing}: what grows, by tracemalloc")
                grown = await top_growth(lambda: soak.run(min(run_s, 60.0)))
    return lines, leaks(outcomes), grown


@contextlib.asynccontextmanager
async def bench(pacing: Pacing) -> AsyncIterator[tuple[Rig, Station]]:
    """A rig and who counts on it; in real time with the processor before others."""
    async with (
        contextlib.AsyncExitStack() as awake,
        rig(pacing) as table,
        station("counting_station", str(table.socket)) as witness,
    ):
        if pacing == "realtime":
            favour_children()
            awake.enter_context(processors_awake())  # not favoured: started afterwards
        yield table, witness


def main(
    json_file: Annotated[Path, typer.Option("--json", help="Where the figures go.")],
    simulated_hours: Annotated[float, typer.Option(help="Machine time in lockstep, hours.")] = WEEK_H,
    real_minutes: Annotated[float, typer.Option(help="Machine time in real time, minutes.")] = 60.0,
    run_minutes: Annotated[float, typer.Option(help="Machine time of one run, minutes.")] = 30.0,
    period_us: Annotated[int, typer.Option(help="SYNC period of the table in real time.")] = PERIOD_US,
    folder: Annotated[Path, typer.Option(help="Recordings and progress.")] = Path("out/soak"),
    fresh: Annotated[bool, typer.Option("--fresh", help="Forget what an earlier soak has done.")] = False,
    traced: Annotated[bool, typer.Option("--trace", help="Name what grows, by tracemalloc.")] = False,
) -> None:
    """Soak, print, write the JSON file whole."""
    console = Console()
    folder.mkdir(parents=True, exist_ok=True)
    progress_file = folder / "progress.jsonl"
    if fresh:
        progress_file.unlink(missing_ok=True)
    before = read_lines(progress_file)
    started, start_s = datetime.now(UTC), time.monotonic()
    result: dict[str, Any] = {
        "started": started.isoformat(timespec="seconds"),
        "machine": {**machine_facts(), "load_before": os.getloadavg()[0]},
    }
    faults = []
    parts: list[tuple[Pacing, float, int]] = [
        ("lockstep", simulated_hours * 3600.0, 1000),
        ("realtime", real_minutes * 60.0, period_us),
    ]
    for pacing, wanted_s, sync_us in parts:
        done = [line for line in before if line["pacing"] == pacing]
        if wanted_s <= 0.0:
            continue
        lines, leaked, grown = asyncio.run(
            soaked(pacing, wanted_s, run_minutes * 60.0, sync_us, folder, done, console.print, traced=traced)
        )
        result[pacing] = {**summary(lines), "leaked": leaked, "grown": grown}
        faults += [f"{pacing}: {text}" for text in (*leaked, *result[pacing]["faults"])]
        faults += [
            f"{pacing}: memory of the {role} grows"
            for role, found in result[pacing]["memory_mib_per_h"].items()
            if found["verdict"] == "grows"
        ]
        if result[pacing]["machine_h"] * 3600.0 < wanted_s - 1.0:
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
