"""Readings of the positioning study: a CSV file with one line per reading, and arrays for the evaluation.

A machine can read its scale. The reading of the interferometer is the true position of the measured point in
the plant at the same instant; only the evaluation uses it.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.files.arrow import write_csv
from studies.wang_2014.plan import DIRECTION_NAMES, Visit


class Reading(NamedTuple):
    """One reading at a target; deviations are actual minus target, metres."""

    series: str
    stage: str
    visit: Visit
    target_mm: float
    time_s: float
    """Machine time since power-up."""
    scale_m: float
    interferometer_m: float


class Deviations(NamedTuple):
    """All deviations of a stage over a series, metres."""

    target_mm: Array
    """(targets,)."""
    scale_m: Array
    """(runs, targets, 2): up, down."""
    interferometer_m: Array
    """(runs, targets, 2): up, down."""


class ReadingsError(ServoCtrlError):
    """Readings that cannot be evaluated."""


def write_readings(path: Path, readings: Iterable[Reading]) -> None:
    """Write the file at once and in whole. Raises OSError."""
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


def deviations(readings: Iterable[Reading]) -> dict[tuple[str, str], Deviations]:
    """Return the deviations by (series, stage). Raises ReadingsError where one is missing or not finite."""
    groups: dict[tuple[str, str], list[Reading]] = {}
    for reading in readings:
        groups.setdefault((reading.series, reading.stage), []).append(reading)
    return {key: _deviations(" ".join(key), rows) for key, rows in groups.items()}


def _deviations(name: str, readings: list[Reading]) -> Deviations:
    runs, targets = (1 + max(reading.visit[i] for reading in readings) for i in range(2))
    target_mm = np.full(targets, np.nan)
    scale_m = np.full((runs, targets, len(DIRECTION_NAMES)), np.nan)
    interferometer_m = scale_m.copy()
    for reading in readings:
        target_mm[reading.visit.target] = reading.target_mm
        scale_m[tuple(reading.visit)] = reading.scale_m
        interferometer_m[tuple(reading.visit)] = reading.interferometer_m
    if not (np.isfinite(scale_m).all() and np.isfinite(interferometer_m).all()):
        raise ReadingsError(
            f"{name}: {runs} runs of {targets} targets in both directions should have {scale_m.size} finite "
            f"readings, there are {len(readings)}"
        )
    return Deviations(target_mm, scale_m, interferometer_m)
