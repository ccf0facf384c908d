"""Frequency response of an axis in its closed loop, from the recording of a multisine.

With the force d that is added, the whole force u = d + loop and the position y, the plant is S_dy / S_du: the
loop takes part in both, so feedback does not bias it (the joint input-output method; Ljung, System
Identification, section 13.5). S_du / S_dd is the sensitivity S = 1 / (1 + L) at the force, so that the loop
itself is measured too. Spectra by Welch's method over whole periods, without a window: nothing leaks.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from kernels.arrays import Array, Index

Response = NDArray[np.complex128]


class Measured(NamedTuple):
    """What one travel has shown in its whole periods, (n,) each, by the SYNC period."""

    added: Array
    """What was added to the set point (N)."""
    whole: Array
    """The whole set point (N), as it went to the amplifier."""
    motor_m: Array
    """Position less the command."""
    scale_m: Array
    """Likewise of the scale; of the motor where there is no scale."""


class FrequencyResponse(NamedTuple):
    """At the lines of the excitation, (n,) each."""

    frequency_hz: Array
    motor: Response
    """Position of the motor per force, m/N, with all delays between two ticks."""
    scale: Response
    """Likewise of the scale."""
    sensitivity: Response
    """1 / (1 + L) at the force."""
    motor_coherence: Array
    scale_coherence: Array
    averages: int
    """Periods that were evaluated."""

    @property
    def loop(self) -> Response:
        """L as it was measured."""
        return np.asarray(1.0 / self.sensitivity - 1.0)

    def relative_error(self, coherence: Array) -> Array:
        """Standard error of a response, a share of it (Bendat and Piersol, Random Data, table 9.6)."""
        bounded = np.clip(coherence, 1e-6, 1.0)
        return np.sqrt((1.0 - bounded) / (2.0 * self.averages * bounded))


def frequency_response(
    travels: Sequence[Measured], period_samples: int, lines: Index, period_s: float
) -> FrequencyResponse:
    """From travels of whole periods. Raises ValueError where there are fewer than two."""
    columns = [
        np.concatenate([_without_drift(part, period_samples) for part in parts])
        for parts in zip(*travels, strict=True)
    ]
    averages = len(columns[0]) // period_samples
    if averages < 2:
        raise ValueError("a coherence needs two periods at least")

    def spectrum(first: Array, second: Array) -> Response:
        _, values = signal.csd(
            first,
            second,
            fs=1.0 / period_s,
            window="boxcar",
            nperseg=period_samples,
            noverlap=0,
            detrend="constant",
        )
        return np.asarray(values)[lines]

    added, whole, motor, scale = columns
    dd, du, dm, ds = (spectrum(added, other) for other in (added, whole, motor, scale))
    return FrequencyResponse(
        frequency_hz=lines / (period_samples * period_s),
        motor=dm / du,
        scale=ds / du,
        sensitivity=du / dd,
        motor_coherence=np.abs(dm) ** 2 / (dd.real * spectrum(motor, motor).real),
        scale_coherence=np.abs(ds) ** 2 / (dd.real * spectrum(scale, scale).real),
        averages=averages,
    )


def _without_drift(values: Array, period_samples: int) -> Array:
    """Values of whole periods less the slope by which they differ from period to period.

    A straight line that is fitted to a period would follow the lowest lines, and leak into all others.
    """
    count = len(values) - period_samples
    if count <= 0:
        return values
    slope = float(np.mean(values[period_samples:] - values[:count])) / period_samples
    return np.asarray(values - slope * np.arange(len(values)))
