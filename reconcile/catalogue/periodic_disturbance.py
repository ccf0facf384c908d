"""A force fixed in time, A sin(2 pi f t): a pump, a fan, another machine."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import median_filter

from reconcile.catalogue.kinds import Hypothesis, Parameter, Sense
from reconcile.catalogue.periodic import amplitude_and_phase, pair

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]

LOWEST_HZ, HIGHEST_HZ = 0.3, 60.0
PEAKS = 8
"""Frequencies to try: those that stand out most."""
FINER = 4
"""Times finer than the longest recording resolves."""
SURROUNDINGS = 101
"""Frequencies that a peak is compared with."""


def _shapes(scenes: Sequence[Scene]) -> list[Shape]:
    period_s = scenes[0].period_s
    length = FINER * max(len(scene.time_s) for scene in scenes)
    power = np.zeros(length // 2 + 1)
    for scene in scenes:
        rest_n = np.where(scene.motion.moving, scene.force_n - scene.model_force_n, 0.0)
        rest_n -= rest_n.mean()
        power += np.abs(np.fft.rfft(rest_n * np.hanning(len(rest_n)), length)) ** 2
    frequency_hz = np.fft.rfftfreq(length, period_s)
    height = power / np.maximum(median_filter(power, FINER * SURROUNDINGS, mode="nearest"), 1e-300)
    height[(frequency_hz < LOWEST_HZ) | (frequency_hz > HIGHEST_HZ)] = 0.0
    peaks = np.flatnonzero((height[1:-1] > height[:-2]) & (height[1:-1] >= height[2:])) + 1
    highest = peaks[np.argsort(height[peaks])[::-1][:PEAKS]]
    return [(float(frequency_hz[peak]),) for peak in highest]


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
