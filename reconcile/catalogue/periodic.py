"""Pairs of sine and cosine: what several entries share."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Parameter

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def pair(angle_rad: Array) -> Array:
    """Columns sin and cos, (n, 2)."""
    return np.stack((np.sin(angle_rad), np.cos(angle_rad)), axis=1)


def amplitude_and_phase(coefficients: Array, unit: str) -> dict[str, Parameter]:
    """A sin + B cos as amplitude and phase of amplitude * sin(angle + phase)."""
    a, b = float(coefficients[0]), float(coefficients[1])
    return {
        "amplitude": Parameter(math.hypot(a, b), unit),
        "phase_rad": Parameter(math.atan2(b, a), "rad"),
    }
