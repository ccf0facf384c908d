"""What the operator's bench costs the cycle: ticks of a table at 1 kHz, nobody looking and ten pages open.

Run as `python -m tests.campaigns.bench.hmi_main --json FILE`. Each round runs the same circle, in turn:
without the local socket; with the page's process; with ten pages of it that are kept up to date
(`hmi_pages`); and with a client that connects and never reads. Lateness, missed ticks and processor time a
cycle are compared with those of the first. Hub and simulator get SCHED_FIFO where permitted: real drives have
their own processors. In all variants alike the processors are kept from going idle (`awake`), or looking on
would seem to help.
"""

import asyncio
import contextlib
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

from servo_ctrl.daemon.cycle.realtime import RealtimeError
from servo_ctrl.hil_rig.simulated_machine import simulated_machine
from tests.campaigns.bench.awake import undisturbed
from tests.campaigns.bench.cyclictest import percentile_us
from tests.campaigns.bench.hmi_runs import MACHINE, SHARES, VARIANTS, Bench, Run
from tests.campaigns.bench.main import machine_facts, table_of, write_whole
from tests.campaigns.bench.outcome import Ratio, Section, Skip

ROUNDS = 3
POLICIES = {"SCHED_OTHER": False, "SCHED_FIFO": True}


async def measure(rounds: int, progress: Callable[[str], None]) -> Section:
    """All variants under both policies, in turn."""
    runs: dict[tuple[str, str], Run] = {}
    skips: list[Skip] = []
    with tempfile.TemporaryDirectory(prefix="bench-") as folder, contextlib.ExitStack() as stack:
        async with simulated_machine(MACHINE, "realtime") as bus:
            favoured = stack.enter_context(undisturbed())
            bench = Bench(bus, Path(folder))
            for number in range(rounds):
                for variant in VARIANTS:
                    async with bench.around(variant):
                        for policy, fifo in POLICIES.items():
                            if policy in {skip.name for skip in skips}:
                                continue
                            progress(f"{variant}, {policy}, round {number + 1} of {rounds}")
                            try:
                                run = await bench.run(variant, fifo=fifo)
                            except RealtimeError as error:
                                skips.append(Skip(policy, str(error)))
                                continue
                            runs[policy, variant] = (
                                runs[policy, variant] + run if (policy, variant) in runs else run
                            )
            progress("counts of the same rows")
            counts = await bench.counts()
    facts: dict[str, Any] = {
        policy: {
            variant: runs[policy, variant].as_json() for variant in VARIANTS if (policy, variant) in runs
        }
        for policy in POLICIES
    }
    facts["hub and simulator with SCHED_FIFO"] = favoured
    facts["counts"] = {**counts._asdict(), "agree": counts.agree}
    return Section("operator's bench", facts, ratios(runs), skips)


def ratios(runs: dict[tuple[str, str], Run]) -> list[Ratio]:
    """Each variant against nobody looking on; 1 us of lateness is as good as none."""
    found = []
    for (policy, variant), run in runs.items():
        if variant == "without":
            continue
        alone = runs[policy, "without"]
        found += [
            Ratio(
                f"tick lateness {name}, {policy}, {variant} / without",
                percentile_us(run.lateness, share),
                max(percentile_us(alone.lateness, share), 1.0),
                "us",
                None,
                at_most=True,
            )
            for name, share in SHARES.items()
        ]
        found.append(
            Ratio(
                f"ticks served, {policy}, {variant} / without",
                run.served / (run.served + run.missed),
                alone.served / (alone.served + alone.missed),
                "of 1",
                None,
            )
        )
        if run.cycles and alone.cycles:  # else it was stopped before the program began
            found.append(
                Ratio(
                    f"processor time a cycle, {policy}, {variant} / without",
                    run.processor_us,
                    alone.processor_us,
                    "us",
                    None,
                    at_most=True,
                )
            )
    return found


def main(
    json_file: Annotated[Path, typer.Option("--json", help="Where the figures go.")],
    rounds: Annotated[int, typer.Option(help="Runs of each kind.")] = ROUNDS,
) -> None:
    """Measure, print a table, write the JSON file whole."""
    console = Console()
    started, start_s, load = datetime.now(UTC), time.monotonic(), os.getloadavg()[0]
    section = asyncio.run(measure(rounds, console.print))
    result = {
        "started": started.isoformat(timespec="seconds"),
        "duration_s": round(time.monotonic() - start_s, 1),
        "machine": {**machine_facts(), "load_before": load},
        **section.as_json(),
    }
    write_whole(json_file, json.dumps(result, indent=2) + "\n")
    console.print(table_of([section]))
    for skip in section.skips:
        console.print(f"[yellow]skipped[/] {skip.name}: {skip.reason}")
    counts = section.facts["counts"]
    console.print(f"counts {'agree' if counts['agree'] else '[red]do not agree[/]'}: {counts}")
    console.print(f"{result['duration_s']} s; written to {json_file}")
    if not counts["agree"]:
        raise typer.Exit(1)


if __name__ == "__main__":
    typer.run(main)
