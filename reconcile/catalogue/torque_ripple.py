"""Torque ripple: the motor force times a periodic factor, 1 + sum e_k sin(k 2 pi x / lead + p_k)."""

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

HARMONICS = (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 18, 20, 24, 30, 36, 42, 48)


def _shapes(_scenes: Sequence[Scene]) -> list[Shape]:
    return [(float(k),) for k in HARMONICS]


def _columns(scene: Scene, shape: Shape) -> Array:
    angle_rad = shape[0] * 2.0 * np.pi / scene.lead_m * scene.motion.position_m
    return scene.model_force_n[:, None] * pair(angle_rad)


HYPOTHESES = [
    Hypothesis(Sense.FORCE, _shapes, _columns),
    Hypothesis(Sense.FORCE, _shapes, _columns, per_recording=True),
]
EQUIVALENT = ()


def parameters(shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """Harmonic, relative amplitude and phase of the torque constant."""
    return {"harmonic": Parameter(shape[0], "1/turn"), **amplitude_and_phase(-coefficients, "")}


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"the force varies by {100.0 * p['amplitude']:.1f} % of itself {p['harmonic']:g} times a turn: "
        "torque ripple; "
        "cogging would be there without current too"
    )
