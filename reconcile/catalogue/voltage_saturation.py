"""Voltage saturation: u <= Umax - Ke |v|, so at speed the drive gives less force than is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Hypothesis, Parameter, Sense

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]

STALL_SHARES = (0.7, 1.0, 1.4, 2.0, 3.0, 5.0)
"""Force at standstill, in the strongest force of the recordings."""
LEAST_CHANGE = 0.1
"""Of the speed, in its maximum."""
SPEED_SHARES = (0.8, 1.05, 1.3, 1.7, 2.5)
"""Speed without load, in the highest speed of the recordings."""


def _shapes(scenes: Sequence[Scene]) -> list[Shape]:
    speeds_m_s = np.abs(np.concatenate([scene.motion.velocity_m_s for scene in scenes]))
    if float(speeds_m_s.std()) < LEAST_CHANGE * float(speeds_m_s.max()):
        return []  # at one speed a limit of the force is all that could be seen
    strongest_n = max(float(np.percentile(np.abs(scene.force_n), 99.9)) for scene in scenes)
    fastest_m_s = max(float(np.abs(scene.motion.velocity_m_s).max()) for scene in scenes)
    return [(f * strongest_n, v * fastest_m_s) for f in STALL_SHARES for v in SPEED_SHARES]


def _columns(scene: Scene, shape: Shape) -> Array:
    stall_n, free_m_s = shape
    v, force_n = scene.motion.velocity_m_s, scene.force_n
    available_n = np.maximum(stall_n * (1.0 - np.abs(v) / free_m_s), 0.0)
    driving = force_n * v > 0.0  # when it brakes, the back EMF helps
    missing_n: Array = np.sign(force_n) * np.maximum(np.abs(force_n) - available_n, 0.0) * driving
    return missing_n[:, None]


HYPOTHESES = [Hypothesis(Sense.FORCE, _shapes, _columns)]
EQUIVALENT = ()


def possible(coefficients: Array) -> bool:
    """Most of what is asked for beyond the limit is missing, and no more than all."""
    return bool(0.5 < coefficients[0] < 1.5)


def parameters(shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """Force at standstill, speed without load, and which share of the excess is missing (all of it: 1)."""
    return {
        "stall_n": Parameter(shape[0], "N"),
        "free_m_s": Parameter(shape[1], "m/s"),
        "missing": Parameter(float(coefficients[0]), ""),
    }


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"where force and speed are high together, what is asked for beyond {p['stall_n']:.0f} N less "
        f"{p['stall_n'] / p['free_m_s']:.0f} N per m/s is missing: the amplifier runs out of voltage; a "
        "saturating torque constant would lose it at low speed too"
    )
