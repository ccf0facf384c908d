"""The controller that led a recorded axis, from `[axis.X.controller]` of a model file.

A sampled cascade: P position controller, PI velocity controller on a difference of motor positions,

    v* = kp (reference - motor) + feedforward d reference/dt
    F  = kv (v* - v) + ki integral(v* - v),   limited,   v = (q[k] - q[k - w]) / (w T)

A P-PD law (kp kv e - kv v, as on EMPS) is this cascade with neither integral nor feedforward.
"""

import math
from pathlib import Path
from typing import Any, NamedTuple

from reconcile.errors import ReconcileError
from reconcile.formats.toml_file import document_of

FORM = "cascade"
MAX_VELOCITY_SAMPLES = 64
"""Bounds the ring buffer of positions; a longer difference would filter the loop itself."""


class Controller(NamedTuple):
    """Gains and timing in SI; the compiled loop reads the fields by name."""

    period_s: float
    position_gain_1_s: float
    velocity_gain_n_s_m: float
    velocity_integral_n_m: float
    velocity_feedforward: float
    velocity_samples: int
    """w: the velocity is a difference over w samples."""
    force_limit_n: float
    delay_s: float
    """From the sample instant until its force takes effect."""


KEYS: dict[str, tuple[float, float, float | None]] = {
    "sample_time_ms": (0.01, 50.0, None),
    "position_gain_1_s": (0.0, 1e5, None),
    "velocity_gain_n_s_m": (0.0, 1e9, None),
    "velocity_integral_n_m": (0.0, 1e12, 0.0),
    "velocity_feedforward": (0.0, 2.0, 0.0),
    "velocity_samples": (1, MAX_VELOCITY_SAMPLES, 1),
    "force_limit_n": (1e-6, 1e9, 1e9),
    "delay_ms": (0.0, 100.0, 0.0),
}
"""Keys beside `form`: lower and upper bound, and the default; a key without one is required."""


def load_controllers(file: Path) -> dict[str, Controller]:
    """Read the controllers of a model file by axis, where it describes one. Raises ReconcileError."""
    axes = document_of(file).get("axis", {})
    tables = axes.items() if isinstance(axes, dict) else ()
    return {
        name: controller_of(file, name, table["controller"])
        for name, table in tables
        if isinstance(table, dict) and "controller" in table
    }


def controller_of(file: Path, axis: str, table: Any) -> Controller:
    """Check one controller section and convert it to SI. Raises ReconcileError naming the key."""
    where = f"axis.{axis}.controller"
    if not isinstance(table, dict):
        raise ReconcileError(file, where, "must be a table")
    if table.get("form") != FORM:
        raise ReconcileError(file, f"{where}.form", f'must be "{FORM}"', "a P-PD law is a cascade too")
    for key in table:
        if key != "form" and key not in KEYS:
            raise ReconcileError(file, f"{where}.{key}", "unknown key", f"known are: {', '.join(KEYS)}")
    values = {
        key: _number(file, f"{where}.{key}", table.get(key, of[2]), *of[:2]) for key, of in KEYS.items()
    }
    samples = values.pop("velocity_samples")
    if samples != round(samples):
        raise ReconcileError(file, f"{where}.velocity_samples", "must be a whole number")
    return Controller(
        period_s=values.pop("sample_time_ms") * 1e-3,
        delay_s=values.pop("delay_ms") * 1e-3,
        velocity_samples=round(samples),
        **values,
    )


def _number(file: Path, where: str, given: Any, low: float, high: float) -> float:
    if given is None:
        raise ReconcileError(file, where, "missing")
    if isinstance(given, bool) or not isinstance(given, int | float) or not math.isfinite(given):
        raise ReconcileError(file, where, f"must be a number, not {given!r}")
    if not low <= given <= high:
        raise ReconcileError(file, where, f"{given:g} is not within {low:g} to {high:g}")
    return float(given)
