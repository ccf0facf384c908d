"""Drifts that a model has as balances of heat, C dT/dt = P - T / R, as the catalogue has them.

Over the time of a run, or over the temperature where that was recorded.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.signal import lfilter

from reconcile.catalogue.kinds import Sense
from reconcile.model_effects_known import Known

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape
    from reconcile.model_effects_known import Asked

    Array = NDArray[np.float64]

SEEN = 1.0 / 3.0
"""Of the time constant; the catalogue looks for none that the recordings see less of."""


class Drift(NamedTuple):
    """How an axis warms in the first recording."""

    shape: Shape
    """As the entries have it: a time constant, or 0 and the temperature at the start."""
    warmth: float
    """What the columns go with, at the warmest place: a share of the end, or kelvin as recorded."""
    kelvin: float
    """By which the plant has warmed there."""


def lubricant(asked: Asked) -> list[Known]:
    """The plant's law bends as it warms; the entry's is the straight line to the warmest place."""
    p, drift = asked.params, _drift(asked)
    if drift.warmth <= 0.0:
        return []
    change = -math.expm1(-drift.kelvin / p.warmth_scale_k) / drift.warmth
    coefficients = (
        asked.base["coulomb_n"] * (p.warm_level_share - 1.0) * change,
        asked.base["viscous_n_s_m"] * (p.warm_damping_share - 1.0) * change,
    )
    return [Known("temperature_dependent_friction", drift.shape, coefficients, Sense.FORCE)]


def expansion(asked: Asked) -> list[Known]:
    """Growth from the start on; a screw that is not at its reference then has a lead error from the start."""
    p = asked.params
    at_start = p.expansion_1_k * (p.start_k - p.reference_k)
    from_the_start = Known("lead_error_cumulative", (), (at_start,), Sense.DEVIATION)
    start_k = recorded_start_k(asked.scenes)
    if start_k is not None:  # the screw has the temperature that was recorded
        growing = (p.expansion_1_k, -p.expansion_1_k * p.fixed_end_m)
        return [Known("thermal_expansion", (0.0, start_k), growing, Sense.DEVIATION), from_the_start]
    final_k = p.ambient_k + p.heat_share * float(_friction_w(asked).mean()) * p.resistance_k_w
    growth = p.expansion_1_k * (final_k - p.start_k)
    if growth == 0.0:
        return [from_the_start]
    coefficients = (growth, -growth * p.fixed_end_m, at_start)
    time_s = p.resistance_k_w * p.heat_capacity_j_k
    return [Known("thermal_expansion", (time_s, 0.0), coefficients, Sense.DEVIATION)]


def recorded_start_k(scenes: Sequence[Scene]) -> float | None:
    """Temperature at the start of the first recording; None unless all of them have it."""
    first = scenes[0].temperature_k
    return float(first[0]) if first is not None and all(s.temperature_k is not None for s in scenes) else None


def _drift(asked: Asked) -> Drift:
    """By the recorded temperature where all the recordings have it, else under the mean of the power."""
    p, scene = asked.params, asked.scenes[0]
    time_s, power_w = p.resistance_k_w * p.heat_capacity_j_k, _friction_w(asked)
    start_k = recorded_start_k(asked.scenes)
    if start_k is None or scene.temperature_k is None:
        longest_s = max(float(one.time_s[-1]) for one in asked.scenes)
        share = 1.0 if longest_s >= SEEN * time_s else -math.expm1(-longest_s / time_s)
        return Drift((time_s, 0.0), share, float(power_w.mean()) * p.resistance_k_w * share)
    kept = math.exp(-scene.period_s / time_s)
    plant_k = lfilter([0.0, p.resistance_k_w * (1.0 - kept)], [1.0, -kept], power_w)
    recorded_k = scene.temperature_k - start_k
    highest_k = float(recorded_k.max())
    squares = float(recorded_k @ recorded_k)
    return Drift((0.0, start_k), highest_k, highest_k * float(recorded_k @ plant_k) / max(squares, 1e-300))


def _friction_w(asked: Asked) -> Array:
    """Power (n,) that heats the axis."""
    speed_m_s = np.abs(asked.scenes[0].motion.velocity_m_s)
    power_w: Array = speed_m_s * (asked.base["coulomb_n"] + asked.base["viscous_n_s_m"] * speed_m_s)
    return power_w
