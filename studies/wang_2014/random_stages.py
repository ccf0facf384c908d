"""Precision stages drawn at random: variations of `machines/precision_stage` that nothing was tuned on.

Masses and friction are drawn as for the tables of the friction study (+-30 %, +-50 %); lead error, wobble and
play within the class that the stage was built from (ISO 3408-3 class 5; a clearance of 0 to 5 um); drive
train, arm and the warmth of the screw within `OTHERS_SHARE`. The machine is cold at power-up: the room is
warmer or colder than the screw, and friction warms it besides.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from hil_sim.config import AxisPlant, PlantConfig
from studies.random_plants import random_plant, varied
from studies.wang_2014.plan import Series, irregular

OTHERS_SHARE = 0.3
"""Largest relative deviation of stiffness, arm, heat capacity and thermal resistance; chosen."""
DAMPING_SHARE = 0.5
"""The same of damping, which is known worst; chosen."""
ROOM_K = 2.0
"""Largest difference between the room and the screw at power-up; chosen."""
WITHIN_THE_CLASS = {
    "lead_error_cumulative": ("relative_error", -1.0),
    "lead_error_periodic": ("amplitude_m", 0.0),
    "backlash": ("play_m", 0.0),
}
"""Effects that the stage has at the limit of their class: field, and the least as a share of that limit."""
RELATIVE = {
    "drive_compliance": {"stiffness_n_m": OTHERS_SHARE, "damping_n_s_m": DAMPING_SHARE},
    "structural_mode": {
        "mass_kg": OTHERS_SHARE,
        "frequency_hz": OTHERS_SHARE,
        "damping_ratio": DAMPING_SHARE,
    },
    "thermal_expansion": {
        "heat_capacity_j_k": OTHERS_SHARE,
        "resistance_k_w": OTHERS_SHARE,
        "heat_share": OTHERS_SHARE,
    },
}
"""Fields that are drawn about their value, with the largest relative deviation."""


class RandomStage(NamedTuple):
    """A drawn stage, and the targets it is positioned to."""

    plant: PlantConfig
    series: Series


def random_stages(plant: PlantConfig, axis: str, count: int, seed: int, cycles: int) -> Iterator[RandomStage]:
    """Yield `count` stages; each has targets of its own, off the grid of the screw's turns."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        drawn = random_plant(plant, rng)
        axes = {**drawn.axes, axis: _drawn(drawn.axes[axis], rng)}
        yield RandomStage(drawn.model_copy(update={"axes": axes}), irregular(rng, cycles))


def _drawn(axis: AxisPlant, rng: np.random.Generator) -> AxisPlant:
    effects: dict[str, Any] = dict(axis.effects)
    for name, (field, least) in WITHIN_THE_CLASS.items():
        limit = getattr(effects[name], field)
        effects[name] = effects[name]._replace(**{field: float(limit * rng.uniform(least, 1.0))})
    for name, shares in RELATIVE.items():
        changed = {
            field: float(varied(getattr(effects[name], field), share, rng)) for field, share in shares.items()
        }
        effects[name] = effects[name]._replace(**changed)
    wobble = effects["lead_error_periodic"]
    effects["lead_error_periodic"] = wobble._replace(phase_rad=float(rng.uniform(0.0, 2.0 * np.pi)))
    screw = effects["thermal_expansion"]
    room_k = screw.start_k + float(rng.uniform(-ROOM_K, ROOM_K))
    effects["thermal_expansion"] = screw._replace(ambient_k=room_k)
    return axis.model_copy(update={"effects": effects})
