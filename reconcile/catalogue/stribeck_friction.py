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

SPEEDS_M_S = (0.0005, 0.001, 0.002, 0.0035, 0.006, 0.01, 0.02)


def _shapes(scenes: Sequence[Scene]) -> list[Shape]:
    fastest_m_s = max(float(np.abs(scene.motion.velocity_m_s).max()) for scene in scenes)
    slowest_m_s = min(scene.motion.creep_m_s for scene in scenes)
    return [(v,) for v in SPEEDS_M_S if slowest_m_s < v < fastest_m_s]


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
