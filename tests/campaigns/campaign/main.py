"""The campaign: `python -m tests.campaigns.campaign.main --runs 5000 --json campaign.json`; docs/campaign.md.

Ctrl-C keeps the finished runs, and the same command continues. `--seed N` makes one run and prints its log.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import time
from collections import deque
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from tests.campaigns.campaign.journal import Journal
from tests.campaigns.campaign.log import show
from tests.campaigns.campaign.table import summary
from tests.campaigns.campaign.worker import leave_interrupts_to_the_parent, run_seeds

if TYPE_CHECKING:
    from concurrent.futures import Future

    from tests.campaigns.campaign.journal import Result

PROCESSES = 2
SEEDS_PER_TASK = 5
"""Runs of one task of a process; chosen."""


def main(
    runs: Annotated[int, typer.Option(help="Runs in all, including earlier ones.")] = 5000,
    json_file: Annotated[Path, typer.Option("--json", help="The summary.")] = Path("campaign.json"),
    journal: Annotated[
        Path, typer.Option(help="Results, one line per run; the campaign continues from it.")
    ] = Path("out/campaign/runs.jsonl"),
    seed: Annotated[int | None, typer.Option(help="Make this one run, and show its log.")] = None,
    processes: Annotated[int, typer.Option(help="Processes.", min=1, max=8)] = PROCESSES,
) -> None:
    """Inject every fault at random instants in random states of the machine."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    if seed is not None:
        raise typer.Exit(show(seed, Console()))
    results_file, start_s = Journal(journal), time.monotonic()
    earlier = len(results_file.done)
    completed = campaign(results_file, runs, processes)
    figures: dict[str, Any] = summary(results_file.done)
    figures["seconds_a_run"] = round(
        (time.monotonic() - start_s) * processes / max(len(results_file.done) - earlier, 1), 3
    )
    json_file.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
    counts = f"{figures['runs']} runs, {figures['reactions']} reactions seen"
    typer.echo(f"{counts}, {figures['runs_with_violations']} runs with violations: {json_file}")
    if not completed:
        typer.echo("interrupted; the same command continues")
    raise typer.Exit(1 if figures["runs_with_violations"] or not completed else 0)


def campaign(results_file: Journal, runs: int, processes: int) -> bool:
    """Make the runs that are missing; return False when it was interrupted."""
    done = {result.seed for result in results_file.done}
    missing_seeds = [seed for seed in range(runs) if seed not in done]
    batches = deque(
        missing_seeds[at : at + SEEDS_PER_TASK] for at in range(0, len(missing_seeds), SEEDS_PER_TASK)
    )
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns) as progress:
        bar = progress.add_task("runs", total=runs, completed=runs - len(missing_seeds))
        context = multiprocessing.get_context("spawn")
        pool = ProcessPoolExecutor(processes, context, leave_interrupts_to_the_parent)
        waiting: set[Future[list[Result]]] = set()
        try:
            while batches or waiting:
                while batches and len(waiting) < 2 * processes:
                    waiting.add(pool.submit(run_seeds, batches.popleft()))
                finished, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                for future in finished:
                    results = future.result()
                    results_file.add(results)
                    progress.advance(bar, len(results))
                violating = sum(bool(result.violations) for result in results_file.done)
                progress.update(
                    bar, description=f"runs, {violating} with violations" if violating else "runs"
                )
        except KeyboardInterrupt:
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # the results are being written
            return False
        finally:
            pool.shutdown(cancel_futures=True)
            for future in waiting:  # the pool has finished the running tasks
                if future.done() and not future.cancelled() and future.exception() is None:
                    results_file.add(future.result())
    return True


if __name__ == "__main__":
    typer.run(main)
