"""`make load`: measures the cycle under a full bus, busy processors and a stalled disk.

Run as `python -m tests.campaigns.endurance.load_main --json load.json [--seconds 30] [--only "bus at 95 %"]`.
No time is bounded, because a busy computer misses ticks. The exit status is 1 if something was lost without
a report.
"""

import asyncio
import json
import os
import tempfile
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from tests.campaigns.bench.awake import undisturbed
from tests.campaigns.bench.main import machine_facts, write_whole
from tests.campaigns.endurance.load import BIT_RATE, SCENARIOS, Scenario, run_under
from tests.campaigns.endurance.rig import PERIOD_US, fifo_is_permitted, rig, station


async def measure(
    scenarios: list[Scenario],
    seconds: float,
    period_us: int,
    progress: Callable[[str], None],
    *,
    favour: bool,
) -> list[dict[str, Any]]:
    """Run each scenario on a new table, with and without SCHED_FIFO for the controller, on a paced bus."""
    results: list[dict[str, Any]] = []
    own_bits_per_s = 0.0
    with tempfile.TemporaryDirectory(prefix="load-") as folder:
        for scenario in scenarios:
            for fifo in (False, True) if fifo_is_permitted() else (False,):
                progress(f"{scenario.name}, {'SCHED_FIFO' if fifo else 'SCHED_OTHER'}")
                async with (
                    rig("realtime", BIT_RATE) as table,
                    station("counting_station", str(table.socket)) as observer,
                    station("foreign_station", str(table.socket), "0") as foreign,
                ):
                    with undisturbed(favour=favour) as favoured:
                        result = await run_under(
                            scenario,
                            table,
                            observer,
                            foreign,
                            Path(folder) / f"run-{len(results)}",
                            own_bits_per_s=own_bits_per_s,
                            # only a stall longer than the buffer in memory has an effect
                            seconds=max(seconds, min(scenario.stall_s, 25.0) + 6.0),
                            period_us=period_us,
                            fifo=fifo,
                        )
                result["hub, simulator and stations with SCHED_FIFO"] = favoured
                if scenario.name == "alone":
                    own_bits_per_s = result["bus_load"] * BIT_RATE
                results.append(result)
    return results


def main(
    json_file: Annotated[Path, typer.Option("--json", help="File for the figures.")],
    seconds: Annotated[float, typer.Option(help="Machine time of a run.")] = 30.0,
    period_us: Annotated[int, typer.Option(help="SYNC period of the table.")] = PERIOD_US,
    only: Annotated[list[str] | None, typer.Option(help="These scenarios; repeatable.")] = None,
    favour: Annotated[
        bool,
        typer.Option(
            "--favour/--no-favour", help="Hub and simulator with SCHED_FIFO, as drives have processors."
        ),
    ] = True,
) -> None:
    """Measure, print a table, and write the JSON file."""
    console = Console()
    started, start_s = datetime.now(UTC), time.monotonic()
    load = os.getloadavg()[0]
    selected = [
        scenario for scenario in SCENARIOS if not only or scenario.name in only or scenario.name == "alone"
    ]
    results = asyncio.run(measure(selected, seconds, period_us, console.print, favour=favour))
    silent = [f"{result['scenario']}: {text}" for result in results for text in result["silent"]]
    document = {
        "started": started.isoformat(timespec="seconds"),
        "period_us": period_us,
        "duration_s": round(time.monotonic() - start_s, 1),
        "machine": {**machine_facts(), "load_before": load},
        "runs": results,
        "silent": silent,
    }
    write_whole(json_file, json.dumps(document, indent=2) + "\n")
    console.print(table_of(results))
    for text in silent:
        console.print(f"[red]not reported[/] {text}")
    if silent:
        raise typer.Exit(1)


def table_of(results: list[dict[str, Any]]) -> Table:
    """Return a table with one row per run."""
    table = Table(
        "load", "scheduler", "bus", "p99 us", "missed", "inputs missing", "rows lost", "ended", "reason"
    )
    for result in results:
        lateness = result.get("lateness_us") or {}
        table.add_row(
            result["scenario"],
            "FIFO" if result["fifo"] else "OTHER",
            f"{100.0 * result['bus_load']:.1f} %",
            f"{lateness.get('p99', float('nan')):.0f}",
            f"{result.get('missed_ticks', '')} of {result.get('cycles', '')}",
            str(result.get("missing_inputs", "")),
            str(result.get("rows_lost", "")),
            result["ended"],
            result["reason"][:60],
        )
    return table


if __name__ == "__main__":
    typer.run(main)
