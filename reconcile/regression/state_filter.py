"""State-variable filter: a signal and its derivatives behind the same low pass.

    L_k(s) = s^k w^3 / (s + w)^3,   k = 0, 1, 2

A balance of forces holds behind the filter as in front of it, and needs no differences of noisy samples:
M a + ... = F becomes M L_2[q] + ... = L_0[F]. This is the injected force of a position observer with three
poles at -w, for a model that is linear in its parameters.
Source: Young (1981), section 3. Discretised by the bilinear transform: both sides meet at the samples.
"""

import math
from functools import cache

from scipy.signal import bilinear, lfilter

from kernels.arrays import Array

ORDER = 3


@cache
def _taps(period_s: float, w: float) -> list[tuple[Array, Array]]:
    """Numerator and denominator of the discrete filter, by derivative."""
    below = [1.0, 3.0 * w, 3.0 * w**2, w**3]
    return [bilinear([w**ORDER] + [0.0] * k, below, 1.0 / period_s) for k in range(ORDER)]


class StateFilter:
    """Three equal poles at `bandwidth_hz`, at the sample time `period_s`."""

    def __init__(self, period_s: float, bandwidth_hz: float) -> None:
        w = 2.0 * math.pi * bandwidth_hz
        self._taps = _taps(period_s, w)
        self.settled = math.ceil(12.0 / w / period_s)
        """Samples until the response to what preceded the recording is below 1e-3."""

    def __call__(self, signal: Array, derivative: int = 0) -> Array:
        """Filter a signal (n,) or (n, k), or its derivative, as if constant before the first sample."""
        b, a = self._taps[derivative]
        filtered: Array = lfilter(b, a, signal - signal[:1], axis=0)
        return filtered + signal[:1] if derivative == 0 else filtered
