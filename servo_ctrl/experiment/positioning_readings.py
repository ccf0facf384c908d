"""Readings of the positioning study: a CSV file with a line a reading, and the arrays that are evaluated.

The scale's reading is what a machine has. The interferometer's is the plant's truth at the measured point,
from the same instant; only the evaluation sees it.
"""

from __future__ import annotations

import csv
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.experiment.positioning_plan import DIRECTION_NAMES
from servo_ctrl.telemetry.parquet import write_csv

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from numpy.typing import NDArray

    from servo_ctrl.experiment.positioning_plan import Visit

    Array = NDArray[np.float64]


class Reading(NamedTuple):
    """One visit, read: deviations are actual minus target, metres."""

    series: str
    stage: str
    visit: Visit
    target_mm: float
    time_s: float
    """Machine time since power-up."""
    scale_m: float
    interferometer_m: float


class Deviations(NamedTuple):
    """All readings of a stage over a series."""

    target_mm: Array
    """(targets,)."""
    scale_m: Array
    """(runs, targets, 2): up, down."""
    interferometer_m: Array
    """Likewise."""


class ReadingsError(ServoCtrlError):
    """A file of readings that cannot be evaluated."""


def write_readings(path: Path, readings: Iterable[Reading]) -> None:
    """Write them whole. Raises OSError."""
    rows = list(readings)
    columns: dict[str, Any] = {
        "series": [row.series for row in rows],
        "stage": [row.stage for row in rows],
        "run": [row.visit.run for row in rows],
        "target": [row.visit.target for row in rows],
        "direction": [DIRECTION_NAMES[row.visit.direction] for row in rows],
        "target_mm": [row.target_mm for row in rows],
        "time_s": [row.time_s for row in rows],
        "scale_m": [row.scale_m for row in rows],
        "interferometer_m": [row.interferometer_m for row in rows],
    }
    write_csv(path, {name: np.asarray(values) for name, values in columns.items()})


def load_readings(path: Path) -> dict[tuple[str, str], Deviations]:
    """The deviations by (series, stage). Raises ReadingsError for a file that is none, or has gaps."""
    found: dict[tuple[str, str], list[tuple[int, int, int, float, float, float]]] = {}
    try:
        with path.open(newline="", encoding="utf-8") as file:
            for line in csv.DictReader(file):
                found.setdefault((line["series"], line["stage"]), []).append(
                    (
                        int(line["run"]),
                        int(line["target"]),
                        DIRECTION_NAMES.index(line["direction"]),
                        float(line["target_mm"]),
                        float(line["scale_m"]),
                        float(line["interferometer_m"]),
                    )
                )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ReadingsError(f"{path}: cannot be read as readings: {error!r}") from None
    return {key: _deviations(path, key, rows) for key, rows in found.items()}


def _deviations(
    path: Path, key: tuple[str, str], rows: list[tuple[int, int, int, float, float, float]]
) -> Deviations:
    runs, targets = 1 + max(row[0] for row in rows), 1 + max(row[1] for row in rows)
    target_mm = np.full(targets, np.nan)
    scale_m = np.full((runs, targets, len(DIRECTION_NAMES)), np.nan)
    interferometer_m = scale_m.copy()
    for run, target, direction, place_mm, scale, interferometer in rows:
        target_mm[target] = place_mm
        scale_m[run, target, direction] = scale
        interferometer_m[run, target, direction] = interferometer
    if len(rows) != scale_m.size or not (np.isfinite(scale_m).all() and np.isfinite(interferometer_m).all()):
        raise ReadingsError(
            f"{path}: {' '.join(key)}: {runs} runs of {targets} targets both ways should have {scale_m.size} "
            f"finite readings, there are {len(rows)} lines"
        )
    return Deviations(target_mm, scale_m, interferometer_m)
