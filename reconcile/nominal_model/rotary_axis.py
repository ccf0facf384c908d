"""A rotary axis of a model file in the coordinates of the computation: 1 m stands for 1 rad.

Accordingly 1 N stands for 1 N m and 1 kg for 1 kg m^2; the laws of the catalogue are the same. The plant of
hil_sim uses the same convention, so that it can run the written model.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hil_sim.config.load import MOTIONS
from reconcile.errors import ReconcileError

KEYS = (
    ("table", "inertia_kg_m2", "mass_kg"),
    ("viscous_friction", "viscous_nm_s_rad", "viscous_n_s_m"),
    ("coulomb_friction", "coulomb_nm", "coulomb_n"),
)
"""Section, key of a rotary axis, key of a linear axis for the same number."""


def is_rotary(file: Path, name: str, table: Mapping[str, Any]) -> bool:
    """Return whether the axis is declared as rotary. Raises ReconcileError for an unknown motion."""
    motion = table.get("motion", MOTIONS[0])
    if motion not in MOTIONS:
        raise ReconcileError(file, f"axis.{name}.motion", f"{motion!r} is neither of {', '.join(MOTIONS)}")
    return bool(motion == "rotary")


def as_linear(file: Path, name: str, table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the table of a rotary axis with the keys of a linear one. Raises ReconcileError.

    Without a torque constant a recorded current counts as the torque at the joint.
    """
    axis: dict[str, Any] = {key: dict(of) if isinstance(of, dict) else of for key, of in table.items()}
    transmission = axis.setdefault("transmission", {})
    if "gear_ratio" in transmission:
        ratio = transmission.pop("gear_ratio")
        if isinstance(ratio, bool) or not isinstance(ratio, int | float) or not ratio > 0.0:
            raise ReconcileError(file, f"axis.{name}.transmission.gear_ratio", "must be a number above zero")
        transmission["lead_mm"] = 2000.0 * math.pi / ratio
    for section, key, same in KEYS:
        if key in axis.get(section, {}):
            axis[section][same] = axis[section].pop(key)
    lead_mm = transmission.get("lead_mm")
    motor = axis.setdefault("motor", {})
    if "torque_constant_nm_a" not in motor and isinstance(lead_mm, int | float):
        motor["torque_constant_nm_a"] = lead_mm / (2000.0 * math.pi)
    return axis
