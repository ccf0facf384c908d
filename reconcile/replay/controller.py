"""The position controller of a recorded axis, from `[axis.X.controller]` of a model file.

A sampled cascade: P position controller, PI velocity controller on a difference of motor positions,

    v* = kp (reference - motor) + feedforward d reference/dt
    F  = kv (v* - v) + ki integral(v* - v),   limited,   v = (q[k] - q[k - w]) / (w T)

A P-PD law (kp kv e - kv v, as on EMPS) is this cascade with neither integral nor feedforward.
"""

from pathlib import Path
from typing import Annotated, Any, NamedTuple

from hil_sim.config import ConfigError
from hil_sim.config.load import read_params
from kernels.quantities import Quantity, fields_of
from reconcile.errors import ReconcileError
from reconcile.formats.toml_file import document_of

FORM = "cascade"
MAX_VELOCITY_SAMPLES = 64
"""Bounds the ring buffer of positions; a longer difference would filter the loop itself."""


class Controller(NamedTuple):
    """Gains and timing as the keys of the file beside `form`; the compiled loop reads the fields by name."""

    sample_time_s: Annotated[float, Quantity("s", 1e-5, 0.05, "sample time", "ms")]
    position_gain_1_s: Annotated[float, Quantity("1/s", 0.0, 1e5, "kp")]
    velocity_gain_n_s_m: Annotated[float, Quantity("N s/m", 0.0, 1e9, "kv")]
    velocity_integral_n_m: Annotated[float, Quantity("N/m", 0.0, 1e12, "ki")] = 0.0
    velocity_feedforward: Annotated[float, Quantity("", 0.0, 2.0, "share of the reference's velocity")] = 0.0
    velocity_samples: Annotated[int, Quantity("", 1, MAX_VELOCITY_SAMPLES, "w")] = 1
    force_limit_n: Annotated[float, Quantity("N", 1e-6, 1e9, "largest force to either side")] = 1e9
    delay_s: Annotated[float, Quantity("s", 0.0, 0.1, "from a sample until its force acts", "ms")] = 0.0


KEYS = ", ".join(field.key for field in fields_of(Controller))


def load_controllers(file: Path) -> dict[str, Controller]:
    """Return the controllers of a model file by axis, of axes that have one. Raises ReconcileError."""
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
    given = dict(table)
    if given.pop("form", None) != FORM:
        raise ReconcileError(file, f"{where}.form", f'must be "{FORM}"', "a P-PD law is a cascade too")
    try:
        params = read_params(file, where, Controller, given)
    except ConfigError as error:
        raise ReconcileError(file, error.key, error.reason, f"known are: {KEYS}") from None
    samples = params.velocity_samples
    if samples != round(samples):
        raise ReconcileError(file, f"{where}.velocity_samples", "must be a whole number")
    return Controller(*params._replace(velocity_samples=round(samples)))
