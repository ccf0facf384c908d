"""Frequency response of an axis in its closed loop, from the recording of a multisine.

With the added force d, the total force u = d + feedback and the position y, the plant is S_dy / S_du. The
loop takes part in both spectra, so feedback does not bias the ratio (joint input-output method; Ljung, System
Identification, section 13.5). S_du / S_dd is the sensitivity S = 1 / (1 + L) at the force, so that the loop
itself is measured too. Spectra are estimated by Welch's method over whole periods, without a window, because
whole periods do not leak.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from kernels.arrays import Array, Index

Response = NDArray[np.complex128]

TRUSTED_ERROR = 0.125
"""Largest relative error of a trusted line: a coherence of 0.8 with 8 periods, 0.89 with 4. Chosen."""


class Measured(NamedTuple):
    """The recording of one travel, its evaluated periods only, (n,) each, sampled at the SYNC period."""

    added_n: Array
    """Force that was added to the output of the control law."""
    total_n: Array
    """Total force set point, as the amplifier received it."""
    motor_m: Array
    """Motor position minus command."""
    scale_m: Array
    """Scale position minus command; the motor's if there is no scale."""


class FrequencyResponse(NamedTuple):
    """At the lines of the excitation, (n,) each."""

    frequency_hz: Array
    motor: Response
    """Motor position per force, m/N, with all delays from tick to tick."""
    scale: Response
    """Scale position per force, likewise."""
    sensitivity: Response
    """1 / (1 + L) at the force."""
    motor_coherence: Array
    """Of the motor response: the lower one of added force with motor position and with total force."""
    scale_coherence: Array
    sensitivity_coherence: Array
    """Of added with total force. Where |L| is large, feedback cancels the added force and noise remains."""
    averages: int
    """Number of evaluated periods."""

    @property
    def loop(self) -> Response:
        """L, from the measured sensitivity."""
        return np.asarray(1.0 / self.sensitivity - 1.0)

    def relative_error(self, coherence: Array) -> Array:
        """Relative standard error of a response, (n,) (Bendat and Piersol, Random Data, table 9.6)."""
        bounded = np.clip(coherence, 1e-6, 1.0)
        return np.sqrt((1.0 - bounded) / (2.0 * self.averages * bounded))

    def trusted(self, coherence: Array) -> NDArray[np.bool_]:
        """Which lines of a response with this coherence are the axis, and not noise, (n,)."""
        return np.asarray(self.relative_error(coherence) <= TRUSTED_ERROR)


def frequency_response(
    travels: Sequence[Measured], period_samples: int, lines: Index, period_s: float
) -> FrequencyResponse:
    """Estimate the response from travels of whole periods.

    `lines`: which multiples of 1 / (period_samples period_s) were excited. Raises ValueError where there are
    fewer than two periods.
    """
    columns = [
        np.concatenate([_without_drift(part, period_samples) for part in parts])
        for parts in zip(*travels, strict=True)
    ]
    averages = len(columns[0]) // period_samples
    if averages < 2:
        raise ValueError("a coherence needs at least two periods")

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

    added, total, motor, scale = columns
    dd, du, dm, ds = (spectrum(added, other) for other in (added, total, motor, scale))
    uu, mm, ss = (spectrum(one, one).real for one in (total, motor, scale))
    force_coherence = np.abs(du) ** 2 / (dd.real * uu)
    return FrequencyResponse(
        frequency_hz=lines / (period_samples * period_s),
        motor=dm / du,
        scale=ds / du,
        sensitivity=du / dd,
        # a quotient is no better than the worse of its two spectra
        motor_coherence=np.minimum(force_coherence, np.abs(dm) ** 2 / (dd.real * mm)),
        scale_coherence=np.minimum(force_coherence, np.abs(ds) ** 2 / (dd.real * ss)),
        sensitivity_coherence=force_coherence,
        averages=averages,
    )


def _without_drift(values: Array, period_samples: int) -> Array:
    """Subtract the slope by which whole periods differ from one to the next.

    A straight line fitted within a period would follow the lowest lines, and leak into all others.
    """
    count = len(values) - period_samples
    if count <= 0:
        return values
    slope = float(np.mean(values[period_samples:] - values[:count])) / period_samples
    return np.asarray(values - slope * np.arange(len(values)))
