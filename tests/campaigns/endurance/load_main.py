"""`make load`: the cycle under a full bus, full processors and a stalled disk; what it does and reports.

Run as `python -m tests.campaigns.endurance.load_main --json load.json [--seconds 30] [--only "bus at 95 %"]`.
Nothing here is a bound on time: a busy computer misses ticks. The exit status is 1 where something was lost
without a report.
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
from tests.campaigns.endurance.load import BITRATE, SCENARIOS, Scenario, run_under
from tests.campaigns.endurance.rig import PERIOD_US, fifo_is_permitted, rig, station


async def measure(
    scenarios: list[Scenario],
    seconds: float,
    period_us: int,
    progress: Callable[[str], None],
    *,
    favour: bool,
) -> list[dict[str, Any]]:
    """Each scenario with and without SCHED_FIFO for the controller, on a paced bus and a table of its own."""
    results: list[dict[str, Any]] = []
    own_bits_per_s = 0.0
    with tempfile.TemporaryDirectory(prefix="load-") as folder:
        for scenario in scenarios:
            for fifo in (False, True) if fifo_is_permitted() else (False,):
                progress(f"{scenario.name}, {'SCHED_FIFO' if fifo else 'SCHED_OTHER'}")
                async with (
                    rig("realtime", BITRATE) as table,
                    station("counting_station", str(table.socket)) as witness,
                    station("foreign_station", str(table.socket), "0") as foreign,
                ):
                    with undisturbed(favour=favour) as favoured:
                        result = await run_under(
                            scenario,
                            table,
                            witness,
                            foreign,
                            Path(folder) / f"run-{len(results)}",
                            own_bits_per_s=own_bits_per_s,
                            # a stalled disk shows once it stands still for longer than what memory takes
                            seconds=max(seconds, min(scenario.stall_s, 25.0) + 6.0),
                            period_us=period_us,
                            fifo=fifo,
                        )
                result["hub, simulator and stations with SCHED_FIFO"] = favoured
                if scenario.name == "alone":
                    own_bits_per_s = result["bus_load"] * BITRATE
                results.append(result)
    return results


def main(
    json_file: Annotated[Path, typer.Option("--json", help="Where the figures go.")],
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
    """Measure, print a table, write the JSON file whole."""
    console = Console()
    started, start_s = datetime.now(UTC), time.monotonic()
    load = os.getloadavg()[0]
    wanted = [each for each in SCENARIOS if not only or each.name in only or each.name == "alone"]
    results = asyncio.run(measure(wanted, seconds, period_us, console.print, favour=favour))
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
    """A row a run."""
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
