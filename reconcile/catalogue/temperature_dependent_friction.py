"""Friction that changes as the axis warms up: with the temperature, or with the run time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Hypothesis, Parameter, Sense

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]

DRIFT = "temperature_dependent_friction"
TIMES_S = (5.0, 15.0, 50.0, 200.0)
DRIFTING = 2
"""So many columns change in a recording; what a shape may have beyond them are levels that stay."""


def own_levels(shape: Shape) -> bool:
    """Whether each recording has levels of its own, too."""
    return len(shape) > 2


def _shapes(scenes: Sequence[Scene]) -> list[Shape]:
    first_k = scenes[0].temperature_k
    if all(scene.temperature_k is not None for scene in scenes) and first_k is not None:
        return [(0.0, float(first_k[0]))]
    longest_s = max(float(scene.time_s[-1]) for scene in scenes)
    times_s = [time for time in TIMES_S if time < 3.0 * longest_s]
    # nobody knows how warm the axis was when each recording began: levels of their own
    own = [(time, 0.0, 1.0) for time in times_s] if len(scenes) > 1 else []
    return [*((time, 0.0) for time in times_s), *own]


def _columns(scene: Scene, shape: Shape) -> Array:
    m = scene.motion
    if shape[0] == 0.0 and scene.temperature_k is not None:
        warmth = scene.temperature_k - shape[1]
    else:
        warmth = -np.expm1(-scene.time_s / shape[0])
    drift = (m.direction * warmth, m.velocity_m_s * warmth)
    return np.stack((*drift, m.direction, m.velocity_m_s) if own_levels(shape) else drift, axis=1)


HYPOTHESES = [
    Hypothesis(Sense.FORCE, _shapes, _columns),
    Hypothesis(Sense.FORCE, _shapes, _columns, per_recording=True),
]
EQUIVALENT = ()


def parameters(shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """Change of level and slope: per kelvin where the temperature was recorded, else in the end."""
    found = {
        "level_n": Parameter(float(coefficients[0]), "N"),
        "viscous_n_s_m": Parameter(float(coefficients[1]), "N s/m"),
    }
    return found if shape[0] == 0.0 else {**found, "time_s": Parameter(shape[0], "s")}


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"friction drifts while the axis runs, by {p['level_n']:.2f} N and {p['viscous_n_s_m']:.1f} N "
        "s/m: it changes "
        "with the temperature of the lubricant; wear would not come back after cooling"
    )
