"""Noise floor of a residual.

Behind the state filter, white noise of force and positions has spectra of known shape. Their two
levels are fitted above the filter's bandwidth, where motion has little power, without peaks, and extrapolated
to all frequencies. Where the measured spectrum is lower, the levels are lowered to it, but not below the
quantisation noise of the sensors, variance q^2 / 12.
Slow noise (drift, a rough guide) is not included: only a repeated recording could tell it from physics.
Sources: Welch (1967), averaged segments; Widrow and Kollar (2008), quantisation as white noise.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.signal.windows import hann

from kernels.arrays import Array
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.recording.kinematics import gaussian_width_s
from reconcile.regression.filter_ends import CORNER_RAD_S, FILTER_HZ
from reconcile.regression.noisy_acceleration import LOWERED_CORNERS_HZ
from reconcile.regression.residual import Residual
from reconcile.regression.resolution import force_step_n
from reconcile.regression.state_filter import ORDER
from reconcile.regression.whiteness import LAGS, Whiteness
from reconcile.sensing.channel import quantum

SEGMENTS_S = (0.512, 0.256, 0.128, 0.064)
"""Lengths tried for the averaged segments, s; the longest of which there are enough is used."""
FEWEST_SEGMENTS = 8
"""Segments to average: a standard error of 35 % of the density."""
READ_BAND = (1.5, 5.0)
"""Band in which the levels are fitted, in bandwidths of the filter."""
PEAK_RATIO = 2.0
"""Density over the fitted one from which on it is a resonance or a line, not noise."""


class NoiseFloor(NamedTuple):
    """RMS of the noise behind the filter, N or m."""

    rms: float
    steps: float
    """RMS of the quantisation noise in it."""
    unit: str


def noise_floor(residuals: Sequence[Residual], channel: ResidualChannel, mass_kg: float) -> NoiseFloor:
    """Noise floor of one channel of one axis; `mass_kg` turns noise of the position into force."""
    frequency_hz, density = spectral_density(residuals, [residual.after for residual in residuals])
    period_s = residuals[0].data.period_s
    white, position_noise = _unit_spectra(frequency_hz, period_s, channel, mass_kg)
    steps = _quantisation_densities(residuals, channel)
    levels = np.maximum(_levels(frequency_hz, density, white, position_noise, period_s), steps)
    width_hz, passed = frequency_hz[1] - frequency_hz[0], _passed(residuals, frequency_hz)

    def rms(white_level: float, image_level: float) -> float:
        noise = (white_level * white + image_level * position_noise) * passed
        return math.sqrt(float(noise.sum()) * width_hz)

    residual_values = np.concatenate([residual.after[residual.used] for residual in residuals])
    largest = math.sqrt(float(np.mean(residual_values**2)))
    return NoiseFloor(
        min(rms(*levels), largest), rms(*steps), "N" if channel is ResidualChannel.FORCE else "m"
    )


def _passed(residuals: Sequence[Residual], frequency_hz: Array) -> Array:
    """Power that the low pass of noisy recordings leaves beside the state filter; 1 without one."""
    corner_hz = max(residual.data.motion.corner_hz for residual in residuals)
    if corner_hz > LOWERED_CORNERS_HZ[0]:
        return np.ones_like(frequency_hz)
    passed: Array = np.exp(-((2.0 * math.pi * gaussian_width_s(corner_hz) * frequency_hz) ** 2))
    return passed


def spectral_density(residuals: Sequence[Residual], values: Sequence[Array]) -> tuple[Array, Array]:
    """Frequencies (Hz) from 0 to Nyquist and one-sided power density (unit^2/Hz), by Welch's method.

    Averages over the segments whose samples are all in use.
    """
    period_s = residuals[0].data.period_s
    for length_s in SEGMENTS_S:
        n = max(round(length_s / period_s), 16)
        segments = [
            segment
            for residual, of in zip(residuals, values, strict=True)
            for segment in _segments(of, residual.used, n)
        ]
        if len(segments) >= FEWEST_SEGMENTS:
            break
    if not segments:
        return np.arange(9) / (16.0 * period_s), np.zeros(9)
    window = hann(n, sym=False)
    transforms = np.fft.rfft(np.stack(segments) * window, axis=1)
    density: Array = 2.0 * period_s / float((window**2).sum()) * np.mean(np.abs(transforms) ** 2, axis=0)
    return np.arange(n // 2 + 1) / (n * period_s), density


def floor_density(floor: NoiseFloor, frequency_hz: Array, period_s: float) -> Array:
    """Density (unit^2/Hz) of white noise behind the filter with the floor's RMS."""
    white = _gain(frequency_hz, period_s) ** 2
    density: Array = white * floor.rms**2 / (float(white.sum()) * (frequency_hz[1] - frequency_hz[0]))
    return density


def noise_json(floor: NoiseFloor, white: dict[str, Whiteness]) -> dict[str, Any]:
    """An entry of `noise_floor` in verdict.json; `white` by model: before, refitted, after."""
    return {
        "rms": floor.rms,
        "from_steps": floor.steps,
        "unit": floor.unit,
        "method": "spectrum above the filter's bandwidth (Welch), not below the sensors' steps (q^2/12)",
        "whiteness": {
            model: {"ljung_box_q": one.q, "degrees_of_freedom": LAGS, "probability": one.probability}
            for model, one in white.items()
        },
    }


def _warped(frequency_hz: Array, period_s: float) -> Array:
    """Angular frequency that the bilinear transform makes of a frequency, rad/s."""
    warped: Array = 2.0 / period_s * np.tan(np.minimum(math.pi * frequency_hz * period_s, 0.499 * math.pi))
    return warped


def _gain(frequency_hz: Array, period_s: float) -> Array:
    """Gain of the discrete state filter."""
    gain: Array = (1.0 + (_warped(frequency_hz, period_s) / CORNER_RAD_S) ** 2) ** (-0.5 * ORDER)
    return gain


def _unit_spectra(
    frequency_hz: Array, period_s: float, channel: ResidualChannel, mass_kg: float
) -> tuple[Array, Array]:
    """Power spectra behind the filter of unit white noise: of the channel, and of the position as a force."""
    white = _gain(frequency_hz, period_s) ** 2
    if channel is ResidualChannel.POSITION_DEVIATION:
        return white, np.zeros_like(white)
    return white, white * (mass_kg * _warped(frequency_hz, period_s) ** 2) ** 2


def _quantisation_densities(residuals: Sequence[Residual], channel: ResidualChannel) -> Array:
    """Densities of the quantisation noise: of the channel and of the position, (2,)."""
    datasets = [residual.data for residual in residuals]
    motor = _quantisation_variance(quantum(data.motion.position_m) for data in datasets)
    density = 2.0 * datasets[0].period_s
    if channel is ResidualChannel.FORCE:
        return density * np.array([_quantisation_variance(map(force_step_n, datasets)), motor])
    scale = _quantisation_variance(quantum(data.scale_m) for data in datasets if data.scale_m is not None)
    return density * np.array([motor + scale, 0.0])


def _quantisation_variance(steps: Iterable[float]) -> float:
    return max((step**2 / 12.0 for step in steps), default=0.0)


def _levels(
    frequency_hz: Array, density: Array, white: Array, position_noise: Array, period_s: float
) -> Array:
    """Fit the densities of both noises above the bandwidth without peaks, (2,).

    Non-negative least squares relative to the fit; samples above PEAK_RATIO times it are dropped, six rounds.
    """
    low, high = READ_BAND[0] * FILTER_HZ, min(READ_BAND[1] * FILTER_HZ, 0.4 / period_s)
    if high < 1.2 * low:
        low, high = 0.25 / period_s, 0.45 / period_s
    band = (frequency_hz >= low) & (frequency_hz <= high) & (density > 0.0)
    levels = np.zeros(2)
    if not band.any():
        return levels
    unit = np.array([of[band].mean() if of.any() else 1.0 for of in (white, position_noise)])
    for _ in range(6):
        if band.sum() < 4:
            break
        fitted = levels[0] * white + levels[1] * position_noise
        weight = 1.0 / np.where(fitted > 0.0, fitted, density)[band]
        columns = np.stack((white[band] / unit[0], position_noise[band] / unit[1]), axis=1) * weight[:, None]
        found, _ = nnls(columns, density[band] * weight)
        levels = found / unit
        band &= density < PEAK_RATIO * (levels[0] * white + levels[1] * position_noise) + 1e-300
    parts = np.stack((levels[0] * white, levels[1] * position_noise))
    return levels * _octave_limits(frequency_hz, density, parts, high)


def _octave_limits(frequency_hz: Array, density: Array, parts: Array, high: float) -> Array:
    """Factors at most 1 by which each part exceeds the spectrum in no octave that it dominates, (2,)."""
    ratios = np.ones(len(parts))
    low = 4.0 * frequency_hz[1]
    while low < high:
        octave = (frequency_hz >= low) & (frequency_hz < 2.0 * low)
        power = parts[:, octave].sum(axis=1)
        if power.any():
            larger = int(np.argmax(power))
            ratios[larger] = min(ratios[larger], float(density[octave].sum() / power.sum()))
        low *= 2.0
    return ratios


def _segments(values: Array, used: NDArray[np.bool_], n: int) -> list[Array]:
    """Segments of n samples, all in use, overlapping by half."""
    runs = np.concatenate(([0], np.cumsum(used)))
    starts = range(0, len(values) - n + 1, n // 2)
    return [values[start : start + n] for start in starts if runs[start + n] - runs[start] == n]
