"""Periodic lead error: scale less motor repeats once a turn of the screw, or a few times."""

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

HARMONICS = (1, 2, 3, 4, 6, 8)


def _shapes(_scenes: Sequence[Scene]) -> list[Shape]:
    return [(float(k),) for k in HARMONICS]


def _columns(scene: Scene, shape: Shape) -> Array:
    return pair(shape[0] * 2.0 * np.pi / scene.lead_m * scene.motion.position_m)


HYPOTHESES = [
    Hypothesis(Sense.DEVIATION, _shapes, _columns),
    Hypothesis(Sense.DEVIATION, _shapes, _columns, per_recording=True),
]
EQUIVALENT = ("encoder_eccentricity",)
"""Told apart by a third sensor only."""


def parameters(shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """Harmonic, amplitude and phase."""
    return {"harmonic": Parameter(shape[0], "1/turn"), **amplitude_and_phase(coefficients, "m")}


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"scale less motor swings by {p['amplitude'] * 1e6:.2f} um {p['harmonic']:g} times a turn: a "
        "periodic lead error, "
        "or an eccentric encoder; a third sensor would tell"
    )
