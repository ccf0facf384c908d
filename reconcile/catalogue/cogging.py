"""Cogging: a force fixed in space, sum A_k sin(k 2 pi x / lead + p_k), whatever the current and the speed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Hypothesis, Parameter, Sense
from reconcile.catalogue.periodic import amplitude_and_phase, pair

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]

HARMONICS = (*range(1, 13), 14, 16, 18, 20, 24, 28, 30, 36, 42, 48, 60, 72, 84, 96)


def _shapes(scenes: Sequence[Scene]) -> list[Shape]:
    # a ripple that the filter or the sampling hides cannot be told
    speeds_m_s = np.abs(np.concatenate([scene.motion.velocity_m_s for scene in scenes]))
    highest = scenes[0].lead_m * 60.0 / max(float(np.percentile(speeds_m_s, 60)), 1e-6)
    return [(float(k),) for k in HARMONICS if k <= max(highest, 12.0)]


def _columns(scene: Scene, shape: Shape) -> Array:
    return pair(shape[0] * 2.0 * np.pi / scene.lead_m * scene.motion.position_m)


HYPOTHESES = [
    Hypothesis(Sense.FORCE, _shapes, _columns),
    Hypothesis(Sense.FORCE, _shapes, _columns, per_recording=True),
]
EQUIVALENT = ()


def parameters(shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """Harmonic, amplitude and phase of the force on the motor."""
    return {"harmonic": Parameter(shape[0], "1/turn"), **amplitude_and_phase(-coefficients, "N")}


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"a force of {p['amplitude']:.2f} N comes back at the same places, {p['harmonic']:g} a turn, "
        "whatever the "
        "speed and the current: cogging; a torque ripple would grow with the current"
    )
