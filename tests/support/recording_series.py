"""A sequence of recordings of one axis by the batch twin: its plant may change from one to the next."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
from concealed_effects import twin_recording
from concealed_machine import PERIOD_S, write_machine
from pyarrow import parquet

from kernels.arrays import Array

FORCE_NOISE_A = 2e-3
"""RMS noise of the current sensor: 0.5 N at the table."""
FIRST_S = 1_700_000_000.0
HOUR_S = 3600.0


def strokes(rng: np.random.Generator, *, fast_mm_s: float = 60.0, way_mm: float = 9.0) -> Array:
    """Return positions (n,) of strokes there and back at different speeds, from rest at 0 to rest at 0."""
    pieces = []
    for share in (0.25, 1.0, 0.5, 1.0, 0.1):
        speed = share * fast_mm_s * rng.uniform(0.95, 1.05)
        way = (1.0 if share > 0.2 else 0.3) * way_mm * rng.uniform(0.95, 1.05)
        ramp_s = speed / rng.uniform(550.0, 650.0)
        pieces.append(_there_and_back(way * 1e-3, way / speed, ramp_s))
    return np.concatenate(pieces)


def _there_and_back(way_m: float, cruise_s: float, ramp_s: float) -> Array:
    cruise = np.full(max(round(cruise_s / PERIOD_S), 2), 1.0)
    ramp = np.ones(max(round(ramp_s / PERIOD_S), 2))
    speed = np.convolve(np.convolve(cruise, ramp), np.ones(10))
    out = way_m * np.cumsum(speed) / speed.sum()
    rest = np.full(60, way_m)
    return np.concatenate((out, rest, way_m - out, 0.0 * rest))


def record(
    folder: Path,
    number: int,
    plant: str,
    *,
    seed: int,
    motion: Callable[[np.random.Generator], Array] = strokes,
    temperature_k: float | None = None,
) -> Path:
    """Write recording `number` and return its file.

    `plant`: sections added to the nominal ones, or lines `key = value` that replace theirs.
    """
    rng = np.random.default_rng([seed, number])
    machine = write_machine(
        folder / "machine", {"x": ""}, motion(rng)[:, None], float(rng.uniform(-20.0, 20.0))
    )
    text = (machine / "plant.toml").read_text(encoding="utf-8")
    for line in plant.splitlines():
        key = line.split("=")[0].strip()
        old = [given for given in text.splitlines() if given.split("=")[0].strip() == key]
        text = text.replace(old[0], line) if old and "=" in line else f"{text}\n{line}"
    changed = machine / "now.toml"
    changed.write_text(text.replace("NAME", "x"), encoding="utf-8")
    raw = twin_recording(machine, changed, folder / "raw.parquet")
    table = parquet.read_table(raw)
    columns = {name: np.asarray(table[name]) for name in table.column_names}
    current = columns["x.motor_current_a"]
    columns["x.motor_current_a"] = current + rng.normal(size=len(current)) * FORCE_NOISE_A
    if temperature_k is not None:
        columns["x.temperature_k"] = (
            np.full(len(current), temperature_k) + rng.normal(size=len(current)) * 0.01
        )
    recordings = folder / "recordings"
    recordings.mkdir(exist_ok=True)
    path = recordings / f"run-{number:03d}.parquet"
    parquet.write_table(pa.table(columns), path)
    os.utime(path, (FIRST_S + number * HOUR_S,) * 2)
    raw.unlink()
    return path


def model(folder: Path) -> Path:
    """Write the nominal model of all recordings; return its file."""
    machine = write_machine(folder / "model", {"x": ""}, np.zeros((10, 1)))
    return machine / "plant.toml"
