"""A force fixed in time, A sin(2 pi f t): a pump, a fan, another machine."""

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

STEP = 1.0
"""Frequencies to scan are so many resolution widths apart."""


def _shapes(_scenes: Sequence[Scene]) -> list[Shape]:
    return []  # the engine looks for the peaks of the residual's spectrum


def _columns(scene: Scene, shape: Shape) -> Array:
    return pair(2.0 * np.pi * shape[0] * scene.time_s)


HYPOTHESES = [Hypothesis(Sense.FORCE, _shapes, _columns, per_recording=True)]
EQUIVALENT = ()


def parameters(shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """Frequency, amplitude, and the phase in the first recording."""
    return {"frequency_hz": Parameter(shape[0], "Hz"), **amplitude_and_phase(-coefficients, "N")}


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"a force of {p['amplitude']:.2f} N at {p['frequency_hz']:.2f} Hz, fixed in time whatever the "
        "speed: a "
        "disturbance from outside; cogging would change its frequency with the speed"
    )
