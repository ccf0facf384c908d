"""The positioning study in the batch twin, as a program of its own: it knows the plant, nothing here does."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from servo_ctrl.experiment.positioning_readings import load_readings
from servo_ctrl.experiment.twin_process import TwinError, run_twin

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from servo_ctrl.experiment.positioning_readings import Deviations

TWIN_LIMIT_S = 1200.0
"""All stages take two minutes on two idle cores."""


class TwinRun(NamedTuple):
    """What the twin has found. `out` is the folder of its readings and of what it learned."""

    out: Path
    found: dict[tuple[str, str], Deviations]
    machine_time_s: float
    wall_s: float


class Wanted(NamedTuple):
    """What the twin is to run; every series begins at power-up."""

    stages: Sequence[str]
    runs: int
    points: int
    series: Sequence[str]
    learned: Path | None = None
    """Store of the screw that is used; without it the twin learns one."""
    off_cycles: int = 0
    rest_cycles: int = 50


def run_in_twin(machine: Path, out: Path, wanted: Wanted, on_progress: Callable[[float], None]) -> TwinRun:
    """Run it; blocks for as long as it takes. `on_progress` is given the share that is done.

    Raises:
        ServoCtrlError: the twin failed, took too long, or left something else than readings.

    """
    arguments = [
        *("--machine", str(machine), "--out", str(out)),
        *("--stages", ",".join(wanted.stages), "--series", ",".join(wanted.series)),
        *("--runs", str(wanted.runs), "--points", str(wanted.points)),
        *("--off-cycles", str(wanted.off_cycles), "--rest-cycles", str(wanted.rest_cycles)),
    ]
    if wanted.learned is not None:
        arguments += ["--learned", str(wanted.learned)]
    told: dict[str, float] = {}
    run_twin(
        "reconcile.positioning", arguments, TWIN_LIMIT_S, lambda line: _take(line.split(), told, on_progress)
    )
    if not {"machine_time", "wall"} <= set(told):
        raise TwinError("the batch twin did not say how long it took")
    return TwinRun(out, load_readings(out / "readings.csv"), told["machine_time"], told["wall"])


def _take(words: list[str], told: dict[str, float], on_progress: Callable[[float], None]) -> None:
    """One line of the twin: "progress DONE TOTAL" or "NAME NUMBER"; another one is for people."""
    try:
        match words:
            case ["progress", done, total]:
                on_progress(float(done) / float(total))
            case [name, value]:
                told[name] = float(value)
    except (ValueError, ZeroDivisionError):
        return
