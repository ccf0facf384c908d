"""The campaign: `python -m tests.campaigns.campaign.main --runs 5000 --json campaign.json`; docs/campaign.md.

Progress is shown, Ctrl-C keeps what was done, and the same command goes on. `--seed N` makes one run and
shows what happened in it.
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
from tests.campaigns.campaign.worker import leave_interrupts_to_the_parent, several

if TYPE_CHECKING:
    from concurrent.futures import Future

    from tests.campaigns.campaign.journal import Result

PROCESSES = 2
AT_ONCE = 5
"""Runs that are handed to a process at one go."""


def main(
    runs: Annotated[int, typer.Option(help="Runs in all, those made before with them.")] = 5000,
    json_file: Annotated[Path, typer.Option("--json", help="The summary.")] = Path("campaign.json"),
    journal: Annotated[Path, typer.Option(help="A line a run; the same file goes on.")] = Path(
        "out/campaign/runs.jsonl"
    ),
    seed: Annotated[int | None, typer.Option(help="Make this one run, and show its log.")] = None,
    processes: Annotated[int, typer.Option(help="Processes.", min=1, max=8)] = PROCESSES,
) -> None:
    """Inject every fault at random instants in random states of the machine."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    if seed is not None:
        raise typer.Exit(show(seed, Console()))
    kept, begun_s = Journal(journal), time.monotonic()
    earlier = len(kept.done)
    whole = campaign(kept, runs, processes)
    facts: dict[str, Any] = summary(kept.done)
    facts["seconds_a_run"] = round(
        (time.monotonic() - begun_s) * processes / max(len(kept.done) - earlier, 1), 3
    )
    json_file.write_text(json.dumps(facts, indent=2) + "\n", encoding="utf-8")
    counts = f"{facts['runs']} runs, {facts['reactions']} reactions seen"
    typer.echo(f"{counts}, {facts['runs_with_violations']} runs with violations: {json_file}")
    if not whole:
        typer.echo("interrupted; the same command goes on")
    raise typer.Exit(1 if facts["runs_with_violations"] or not whole else 0)


def campaign(kept: Journal, runs: int, processes: int) -> bool:
    """Make the runs that are missing; return False when it was interrupted."""
    done = {result.seed for result in kept.done}
    wanted = [seed for seed in range(runs) if seed not in done]
    batches = deque(wanted[at : at + AT_ONCE] for at in range(0, len(wanted), AT_ONCE))
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns) as progress:
        bar = progress.add_task("runs", total=runs, completed=runs - len(wanted))
        context = multiprocessing.get_context("spawn")
        pool = ProcessPoolExecutor(processes, context, leave_interrupts_to_the_parent)
        waiting: set[Future[list[Result]]] = set()
        try:
            while batches or waiting:
                while batches and len(waiting) < 2 * processes:
                    waiting.add(pool.submit(several, batches.popleft()))
                over, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                for future in over:
                    results = future.result()
                    kept.add(results)
                    progress.advance(bar, len(results))
                bad = sum(bool(result.violations) for result in kept.done)
                progress.update(bar, description=f"runs, {bad} with violations" if bad else "runs")
        except KeyboardInterrupt:
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # once is enough: what was done is being written
            return False
        finally:
            pool.shutdown(cancel_futures=True)
            for future in waiting:  # what was under way when it was broken off has come to its end
                if future.done() and not future.cancelled() and future.exception() is None:
                    kept.add(future.result())
    return True


if __name__ == "__main__":
    typer.run(main)
