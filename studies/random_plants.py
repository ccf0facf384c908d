"""Plants drawn at random about a known one: masses and every friction parameter, independently.

What else a study varies, it draws with `varied` beside them.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from hil_sim.config import AxisPlant, PlantConfig

MASS_SHARE, FRICTION_SHARE = 0.3, 0.5
"""Bound the relative deviations of masses and of friction parameters; from the specification."""
FORCES = {
    "viscous_friction": ("viscous_n_s_m",),
    "coulomb_friction": ("coulomb_n",),
    "stribeck_friction": ("stribeck_n",),
    "presliding_gms": ("stiffness_n_m", "attraction_n_s", "micro_damping_n_s_m"),
}
"""Friction effects, and their fields that are proportional to the force."""


def varied(value: Any, share: float, rng: np.random.Generator) -> Any:
    """Return a number, or all numbers of a tuple, at a random ratio within 1 +- `share`."""
    return scaled(value, float(1.0 + rng.uniform(-share, share)))


def scaled(value: Any, ratio: float) -> Any:
    """Return a number, or all numbers of a tuple, times a ratio."""
    return tuple(entry * ratio for entry in value) if isinstance(value, tuple) else value * ratio


def random_plant(plant: PlantConfig, rng: np.random.Generator) -> PlantConfig:
    """Return the plant with random masses of its tables and random friction parameters."""

    def changed(axis: AxisPlant) -> AxisPlant:
        effects = {
            key: effect._replace(
                **{
                    field: varied(value, FRICTION_SHARE, rng)
                    for field, value in effect._asdict().items()
                    if field not in ("enabled", "share")
                }
            )
            if key in FORCES
            else effect
            for key, effect in axis.effects.items()
        }
        mass_kg = varied(axis.table.mass_kg, MASS_SHARE, rng)
        table = axis.table.model_copy(update={"mass_kg": mass_kg})
        return axis.model_copy(update={"effects": effects, "table": table})

    return each_axis(plant, changed)


def each_axis(plant: PlantConfig, change: Callable[[AxisPlant], AxisPlant]) -> PlantConfig:
    """Return the plant with every axis changed."""
    axes = {name: change(axis) for name, axis in plant.axes.items()}
    return plant.model_copy(update={"axes": axes})
