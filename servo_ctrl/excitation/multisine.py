"""Excitation of an axis: travels at constant speed, with an added multisine force.

The speed keeps the axis out of presliding: the friction of an axis that does not reverse is nearly constant,
and its plant nearly linear. The multisine is periodic, so that its lines do not leak into each other, and
what is not periodic (friction, cogging, noise) shows as a loss of coherence (Pintelon and Schoukens, System
Identification: A Frequency Domain Approach, chapter 2).
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array, Index

LEAST_PERIOD_S = 2.0
"""Least duration of a period: lines half a hertz apart or closer. Chosen, as are the numbers below."""
DENSE_TO_HZ, LINE_RATIO = 60.0, 1.01
"""Every line is excited up to this frequency; above it, the next line is this factor higher."""
LOWEST_HZ = 1.0
HIGHEST_SHARE = 0.9
"""Highest line, as a share of half the sampling rate."""
SETTLING_S = 0.25
"""Time at constant speed before the force begins."""


class Multisine(NamedTuple):
    """One period of a force whose largest value is 1."""

    values: Array
    """(n,)."""
    lines: Index
    """Multiples of 1 / (n T) that it contains, T the sampling period."""


class Travel(NamedTuple):
    """One travel of the measurement, set points at the SYNC period, (n,) each."""

    position_m: Array
    force_n: Array
    first: int
    """Index of the sample at which the first evaluated period begins."""


def multisine(period_s: float) -> Multisine:
    """Return a multisine with the phases of Schroeder (1970), whose peak is low for its power.

    The amplitudes grow with the square root of the frequency, because the response of the plant falls with
    its square and the noise does not.
    """
    count = 2 ** math.ceil(math.log2(LEAST_PERIOD_S / period_s))
    every = np.arange(1, int(HIGHEST_SHARE * 0.5 * count) + 1)
    frequency_hz = every / (count * period_s)
    lines, following_hz = [], 0.0
    for line, line_hz in zip(every.tolist(), frequency_hz.tolist(), strict=True):
        if line_hz >= max(LOWEST_HZ, following_hz):
            lines.append(line)
            following_hz = line_hz * LINE_RATIO if line_hz > DENSE_TO_HZ else 0.0
    index = np.array(lines)
    amplitude = np.sqrt(index / index[-1])
    power = amplitude**2 / np.sum(amplitude**2)
    # the group delay of a line is the share of the power below it, so that the lines are excited in turn
    before = np.concatenate(([0.0], np.cumsum(power)[:-1]))
    phase = -2.0 * math.pi * np.cumsum(np.diff(index, prepend=index[0]) * before)
    spectrum = np.zeros(count // 2 + 1, dtype=np.complex128)
    spectrum[index] = amplitude * np.exp(1j * phase)
    values = np.fft.irfft(spectrum, count)
    return Multisine(values / np.abs(values).max(), index)


def travel(
    force: Multisine, amplitude_n: float, periods: int, speed_m_s: float, ramp_s: float, period_s: float
) -> Travel:
    """Return a travel from 0 along `speed_m_s`: one period to settle, then `periods` to evaluate.

    The speed ramps up and down within `ramp_s` each; the force peaks at `amplitude_n`.
    """
    ramp = max(2, round(ramp_s / period_s))
    rise = _raised_cosine(ramp)
    settling = round(SETTLING_S / period_s)
    count = len(force.values)
    cruise = settling + (periods + 1) * count
    velocity_m_s = speed_m_s * np.concatenate((rise, np.ones(cruise), rise[::-1], [0.0]))
    force_n = np.zeros(len(velocity_m_s))
    start = ramp + settling
    force_n[start : start + (periods + 1) * count] = amplitude_n * np.tile(force.values, periods + 1)
    fade = count // 2
    force_n[start : start + fade] *= _raised_cosine(fade)
    return Travel(np.cumsum(velocity_m_s) * period_s, force_n, start + count)


def _raised_cosine(count: int) -> Array:
    """Return a rise from 0 to 1 with a continuous first derivative, (n,)."""
    return np.asarray(0.5 * (1.0 - np.cos(math.pi * (np.arange(count) + 0.5) / count)))


def travel_time_s(periods: int, ramp_s: float, period_s: float) -> float:
    """Return the length of a travel over its speed, s: a ramp covers half the distance of full speed."""
    count = 2 ** math.ceil(math.log2(LEAST_PERIOD_S / period_s))
    return float(SETTLING_S + (periods + 1) * count * period_s + ramp_s)
