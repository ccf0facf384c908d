"""Stribeck friction: (Fs - Fc) exp(-(v / vs)^2) in the direction of motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Hypothesis, Parameter, Sense

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]

LEAST_S = 0.3
PASSING_S = 5e-3
"""What lasts shorter is a reversal to the filters, and no speed."""
SPEEDS_M_S = (0.0005, 0.001, 0.002, 0.0035, 0.006, 0.01, 0.014, 0.02, 0.03, 0.05)


def _shapes(scenes: Sequence[Scene]) -> list[Shape]:
    return [(v,) for v in SPEEDS_M_S if _seen_s(scenes, v) > LEAST_S]


def _seen_s(scenes: Sequence[Scene], speed_m_s: float) -> float:
    """How long the axis moved as slowly as that, without only passing through on its way to another speed."""
    seen_s = 0.0
    for scene in scenes:
        m = scene.motion
        slow = m.moving & (np.abs(m.velocity_m_s) < 1.5 * speed_m_s)
        steady = np.abs(m.acceleration_m_s2) * PASSING_S < speed_m_s
        seen_s += scene.period_s * float(np.count_nonzero(slow & steady))
    return seen_s


def _columns(scene: Scene, shape: Shape) -> Array:
    m = scene.motion
    return (m.direction * np.exp(-((m.velocity_m_s / shape[0]) ** 2)))[:, None]


HYPOTHESES = [Hypothesis(Sense.FORCE, _shapes, _columns)]
EQUIVALENT = ()


def parameters(shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """Fs - Fc, negative where friction falls towards standstill, and vs."""
    return {
        "stribeck_n": Parameter(float(coefficients[0]), "N"),
        "stribeck_m_s": Parameter(shape[0], "m/s"),
    }


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    sense = "rises" if p["stribeck_n"] > 0.0 else "falls"
    return (
        f"friction {sense} by {abs(p['stribeck_n']):.2f} N below {p['stribeck_m_s'] * 1e3:.1f} mm/s, in both "
        "directions alike and at constant speed too: Stribeck friction; presliding would show over the "
        "way, not the speed"
    )
