"""Nonlinearities of the concealed axis: a skewed periodic wave, Bouc-Wen hysteresis and quantisation."""

import math
from typing import Any

import numpy as np

from tests.campaigns.blind.compiled import compiled


@compiled
def wave(angle: Any, skew: float) -> Any:
    """Return a periodic shape that is not a sine: its phase advances unevenly.

    Without its mean, J1(skew) sin(1).
    """
    mean = (skew / 2.0 - skew**3 / 16.0 + skew**5 / 384.0) * math.sin(1.0)  # skew is below 0.5
    return np.sin(angle + skew * np.sin(angle + 1.0)) - mean


@compiled
def bouc_wen(z: float, travel: float, sharpness: float, unloading: float) -> float:
    """Return the Bouc-Wen variable after a signed travel in presliding lengths, integrated in small steps."""
    parts = int(abs(travel) / 0.1) + 1
    if parts > 40:
        return 1.0 if travel > 0.0 else -1.0
    step = travel / parts
    for _ in range(parts):
        towards = 1.0 if z * step > 0.0 else -1.0
        z += step * (1.0 - abs(z) ** sharpness * (unloading + (1.0 - unloading) * towards))
        z = min(max(z, -1.0), 1.0)
    return z


@compiled
def quantised(value: float, count: float) -> float:
    """Return the value rounded down to whole counts; unchanged where `count` is 0."""
    return math.floor(value / count) * count if count > 0.0 else value
