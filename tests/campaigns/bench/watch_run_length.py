"""How often `reconcile watch` gives a false alarm, and how soon it detects a change.

Run as `python -m tests.campaigns.bench.watch_run_length --json FILE`. Two levels: the statistics alone on
random numbers, many of them; and whole recordings of hil_sim's plant in the batch twin, from file to alarm.
"""

import json
import math
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[2] / "support"))

from collections.abc import Callable, Iterator

from recording_series import model, record, strokes

from kernels.arrays import Array
from reconcile.watch.change_detection import IndicatorSeries, newest_alarm, onset
from reconcile.watch.watch import Watch, WatchOptions
from tests.campaigns.bench.main import write_whole

LENGTH = 60
"""Recordings of a sequence of random numbers."""
RUN_LENGTHS = (20.0, 100.0)
"""Allowed recordings between false alarms: short ones, so that alarms can be counted."""
BEFORE, AFTER, QUIET = 12, 14, 40
"""Recordings before a change, most after it, and of a machine that stays as it is."""
PLAY = """[axis.NAME.drive_compliance]
stiffness_n_um = 200.0
damping_n_s_m = 5000.0
[axis.NAME.backlash]
play_um = {}"""
PROGRAMS: tuple[dict[str, float], ...] = (
    {},
    {"fast_mm_s": 130.0, "way_mm": 20.0},
    {"fast_mm_s": 30.0, "way_mm": 4.0},
)
CHANGES: dict[str, Callable[[float], str]] = {
    "nothing": lambda _age: "coulomb_n = 10.0",
    "Coulomb friction falls by 5 %": lambda age: f"coulomb_n = {10.0 - 0.5 * bool(age)}",
    "Coulomb friction falls by 10 %": lambda age: f"coulomb_n = {10.0 - bool(age)}",
    "Coulomb friction falls by 30 %": lambda age: f"coulomb_n = {10.0 - 3.0 * bool(age)}",
    "viscous friction rises by 50 %": lambda age: f"viscous_n_s_m = {80.0 + 40.0 * bool(age)}",
    "play of 1 um more": lambda age: PLAY.format(0.5 + 0.5 * bool(age)),
    "play grows by 0.1 um a recording": lambda age: PLAY.format(0.5 + 0.05 * age),
    "Coulomb friction grows by 0.2 N a recording": lambda age: f"coulomb_n = {10.0 + 0.2 * age}",
}
"""Keys of the plant file by how many recordings the change is old, 0 = not yet."""


def noise(kind: str, rng: np.random.Generator) -> Array:
    """Standardised values of one indicator over the recordings, (LENGTH,)."""
    white = rng.normal(size=LENGTH)
    if kind == "tails of Student's t with 5 degrees":
        return np.asarray(rng.standard_t(5, size=LENGTH) / math.sqrt(5.0 / 3.0))
    if kind == "errors told half as large":
        return 2.0 * white
    if kind == "correlated, 0.3 from one to the next":
        for i in range(1, LENGTH):
            white[i] = 0.3 * white[i - 1] + math.sqrt(1.0 - 0.09) * white[i]
    return white


def plain(values: Array) -> IndicatorSeries:
    """A sequence of one kind of motion."""
    n = len(values)
    return IndicatorSeries(values, np.ones(n), np.zeros((n, 1)), np.full(n, np.nan), 0.0, 0.0)


def statistics(sequences: int) -> Iterator[dict[str, Any]]:
    """False alarms in random numbers, one indicator; a sequence ends with its first one."""
    kinds = (
        "normal",
        "tails of Student's t with 5 degrees",
        "errors told half as large",
        "correlated, 0.3 from one to the next",
    )
    for kind in kinds:
        for run_length in RUN_LENGTHS:
            rng = np.random.default_rng(1)
            alarms = recordings = 0
            for _ in range(sequences):
                values = noise(kind, rng)
                for n in range(1, LENGTH + 1):
                    recordings += 1
                    alarm = newest_alarm(plain(values[:n]), 1, run_length)
                    if alarm is not None and alarm.raised:
                        alarms += 1
                        break
            yield {
                "noise": kind,
                "allowed_per_1000": 1000.0 / run_length,
                "per_1000": 1000.0 * alarms / recordings,
                "alarms": alarms,
            }


def coverage(sequences: int) -> Iterator[dict[str, Any]]:
    """How often the interval of 95 % holds the onset, and a form is called by its name."""
    rng = np.random.default_rng(2)
    for size in (3.0, 5.0, 10.0):
        for form in ("step", "ramp"):
            inside = right = wrong = 0
            for _ in range(sequences):
                k = int(rng.integers(8, 28))
                since = np.arange(36) - k + 1.0
                shape = (since > 0) if form == "step" else np.maximum(since, 0.0) / 8.0
                when = onset(plain(rng.normal(size=36) + size * shape))
                inside += when.low <= k <= when.high
                is_right = (when.ramp_probability > 0.9) == (form == "ramp")
                is_sure = abs(when.ramp_probability - 0.5) > 0.4
                right += is_right and is_sure
                wrong += not is_right and is_sure
            yield {
                "form": form,
                "size_in_errors": size,
                "interval_holds": inside / sequences,
                "form_right": right / sequences,
                "form_wrong": wrong / sequences,
            }


def machines(name: str, seeds: int) -> dict[str, Any]:
    """Whole recordings of three programs in turns by chance, up to the first alarm."""
    delays: list[int] = []
    inside = false_alarms = recordings = missed = 0
    quiet = name == "nothing"
    length = QUIET if quiet else BEFORE + AFTER
    for seed in range(seeds):
        change = _first_change(name, seed, length)
        alarm = length if change is None else _number(change["alarm"]["recording"])
        recordings += min(alarm + 1, length)
        if change is None:
            missed += not quiet
        elif quiet or alarm < BEFORE:
            false_alarms += 1
        else:
            delays.append(alarm - BEFORE + 1)
            low, high = map(_number, change["began"]["interval95"])
            inside += low <= BEFORE <= high
    return {
        "change": name,
        "machines": seeds,
        "recordings": recordings,
        "false_alarms": false_alarms,
        "missed": missed,
        "delay_median": float(np.median(delays)) if delays else None,
        "delay_largest": max(delays, default=None),
        "interval_holds": inside / len(delays) if delays else None,
    }


def _first_change(name: str, seed: int, length: int) -> dict[str, Any] | None:
    rng = np.random.default_rng([3, seed])
    with tempfile.TemporaryDirectory() as folder_name:
        folder = Path(folder_name)
        model(folder)
        for number in range(length):
            program = PROGRAMS[int(rng.integers(len(PROGRAMS)))]
            age = 0.0 if name == "nothing" else max(number - BEFORE + 1.0, 0.0)
            motion = partial(strokes, **program)
            record(folder, number, CHANGES[name](age), seed=seed, motion=motion)
        out = folder / "out"
        watch = Watch(folder / "recordings", folder / "model", out, WatchOptions(diagnose=False))
        watch.read_new()
    return next(iter(watch.history.document["changes"]), None)


def _number(recording: str) -> int:
    """Of `run-012.parquet`."""
    return int(recording.removeprefix("run-").removesuffix(".parquet"))


def main(
    json_file: Annotated[Path, typer.Option("--json", help="Write the figures to this file.")],
    seeds: Annotated[int, typer.Option(help="Machines for each change.")] = 6,
    quiet_seeds: Annotated[int, typer.Option(help="Machines that stay as they are.")] = 25,
    sequences: Annotated[int, typer.Option(help="Sequences of random numbers.")] = 300,
) -> None:
    """Measure, print, write."""
    console = Console()
    found: dict[str, list[dict[str, Any]]] = {"random numbers": [], "onset": [], "machines": []}
    with console.status("random numbers"):
        found["random numbers"] = list(statistics(sequences))
        found["onset"] = list(coverage(sequences))
    for name in CHANGES:
        with console.status(name):
            found["machines"].append(machines(name, quiet_seeds if name == "nothing" else seeds))
    for title, rows in found.items():
        table = Table(*rows[0], title=title)
        for row in rows:
            table.add_row(*(f"{one:.3g}" if isinstance(one, float) else str(one) for one in row.values()))
        console.print(table)
    write_whole(json_file, json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    typer.run(main)
