"""How much of a difference is noise, and whether what is left is nothing but noise.

Noise floor: behind the state filter, white noise of the force and of the positions has a spectrum of known
shape. Its two levels are read above the filter's bandwidth, where a motion leaves little, peaks left out, and
carried down to all frequencies; where the spectrum is lower there, so are they (what lay above was no noise),
but not below those of the sensors' steps, a rectangle of variance q^2 / 12.
Noise that is slow (drift, a rough guide) is not in it: that cannot be told from physics without a repeat.
Sources: Welch (1967), spectrum from averaged pieces; Widrow and Kollar (2008), quantisation as white noise.

Whiteness: the filter makes white noise correlated for some milliseconds, no longer. So the rest is taken at
samples that far apart; what is still correlated then is not noise. Source: Ljung and Box (1978).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.optimize import nnls
from scipy.signal.windows import hann
from scipy.stats import chi2

from reconcile.catalogue.kinds import Sense
from reconcile.scenes import FILTER_HZ
from reconcile.sensing_channel import quantum
from reconcile.state_filter import ORDER

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.rests import Rest

    Array = NDArray[np.float64]

PIECES_S = (0.512, 0.256, 0.128, 0.064)
FEWEST_PIECES = 8
BAND = (1.5, 5.0)
"""Of the filter's bandwidth: where the levels are read."""
PEAK = 2.0
"""Times the fitted spectrum: a resonance or a line, and no noise."""
APART = 9.5
"""Time constants of the filter: its own correlation is 0.3 % by then."""
LAGS = 20


class NoiseFloor(NamedTuple):
    """RMS in SI, N or m, behind the filter."""

    rms: float
    steps: float
    """Of it, what the sensors' steps make."""
    unit: str


class Whiteness(NamedTuple):
    """Correlation of a rest with itself."""

    lags_s: Array
    correlation: Array
    bound: float
    """95 % of white noise stays within."""
    q: float
    """Of Ljung and Box, `LAGS` degrees of freedom."""
    probability: float
    """That white noise has a larger one."""


def noise_floor(rests: Sequence[Rest], sense: Sense, mass_kg: float) -> NoiseFloor:
    """Of one sense of one axis; `mass_kg` turns noise of the position into force."""
    frequency_hz, density = spectral_density(rests, [rest.after for rest in rests])
    period_s = rests[0].scene.period_s
    white, image = _shapes(frequency_hz, period_s, sense, mass_kg)
    steps = _steps(rests, sense)
    levels = np.maximum(_levels(frequency_hz, density, white, image, period_s), steps)
    width_hz = frequency_hz[1] - frequency_hz[0]

    def rms(white_level: float, image_level: float) -> float:
        return math.sqrt(float((white_level * white + image_level * image).sum()) * width_hz)

    left = np.concatenate([rest.after[rest.used] for rest in rests])
    largest = math.sqrt(float(np.mean(left**2)))
    return NoiseFloor(min(rms(*levels), largest), rms(*steps), "N" if sense is Sense.FORCE else "m")


def spectral_density(rests: Sequence[Rest], values: Sequence[Array]) -> tuple[Array, Array]:
    """One-sided power density (unit^2/Hz) over the pieces whose samples are all in use, from 0 to Nyquist."""
    period_s = rests[0].scene.period_s
    for length_s in PIECES_S:
        n = max(round(length_s / period_s), 16)
        pieces = [
            piece for rest, of in zip(rests, values, strict=True) for piece in _pieces(of, rest.used, n)
        ]
        if len(pieces) >= FEWEST_PIECES:
            break
    if not pieces:
        return np.arange(9) / (16.0 * period_s), np.zeros(9)
    window = hann(n, sym=False)
    transforms = np.fft.rfft(np.stack(pieces) * window, axis=1)
    density: Array = 2.0 * period_s / float((window**2).sum()) * np.mean(np.abs(transforms) ** 2, axis=0)
    return np.arange(n // 2 + 1) / (n * period_s), density


def whiteness(rests: Sequence[Rest], values: Sequence[Array]) -> Whiteness:
    """Of one model's rests."""
    period_s = rests[0].scene.period_s
    step = max(math.ceil(APART / (2.0 * math.pi * FILTER_HZ) / period_s), 1)
    whole = np.concatenate([of[rest.used] for rest, of in zip(rests, values, strict=True)])
    mean = float(whole.mean())
    products, pairs = np.zeros(LAGS + 1), np.zeros(LAGS + 1)
    for rest, of in zip(rests, values, strict=True):
        thin, used = (of - mean)[::step] * rest.used[::step], rest.used[::step].astype(np.float64)
        for lag in range(min(LAGS + 1, len(thin))):
            products[lag] += thin[lag:] @ thin[: len(thin) - lag]
            pairs[lag] += used[lag:] @ used[: len(used) - lag]
    count = max(float(pairs[0]), 1.0)
    variance = float(products[0]) / count
    lags_s = np.arange(1.0, LAGS + 1.0) * (step * period_s)
    if variance <= 0.0:
        return Whiteness(lags_s, np.zeros(LAGS), 0.0, 0.0, 1.0)
    correlation = products[1:] / np.maximum(pairs[1:], 1.0) / variance
    # a lag has as many pairs as both its samples are in use: gaps make them fewer than in one long series
    q = float((count + 2.0) / count * (pairs[1:] * correlation**2).sum())
    return Whiteness(
        lags_s,
        correlation,
        1.96 / math.sqrt(count),
        q,
        float(chi2.sf(q, LAGS)),
    )


def floor_density(floor: NoiseFloor, frequency_hz: Array, period_s: float) -> Array:
    """The floor as white noise behind the filter, for a picture beside a spectrum."""
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


def _gain(frequency_hz: Array, period_s: float) -> Array:
    """Of the state filter, as the bilinear transform has it."""
    corner = 2.0 * math.pi * FILTER_HZ
    warped = 2.0 / period_s * np.tan(np.minimum(math.pi * frequency_hz * period_s, 0.499 * math.pi))
    gain: Array = (1.0 + (warped / corner) ** 2) ** (-0.5 * ORDER)
    return gain


def _shapes(frequency_hz: Array, period_s: float, sense: Sense, mass_kg: float) -> tuple[Array, Array]:
    """Power behind the filter of white noise of the difference, and of the position as a force; per unit."""
    white = _gain(frequency_hz, period_s) ** 2
    if sense is Sense.DEVIATION:
        return white, np.zeros_like(white)
    warped = 2.0 / period_s * np.tan(np.minimum(math.pi * frequency_hz * period_s, 0.499 * math.pi))
    return white, white * (mass_kg * warped**2) ** 2


def _steps(rests: Sequence[Rest], sense: Sense) -> Array:
    """Densities (of the difference, of the position) that the sensors' steps make."""
    scenes = [rest.scene for rest in rests]
    motor = _rectangle([scene.motion.position_m for scene in scenes])
    density = 2.0 * scenes[0].period_s
    if sense is Sense.FORCE:
        return density * np.array([_rectangle([scene.force_n for scene in scenes]), motor])
    scale = _rectangle([scene.scale_m for scene in scenes if scene.scale_m is not None])
    return density * np.array([motor + scale, 0.0])


def _rectangle(channels: Sequence[Array]) -> float:
    return max((quantum(of) ** 2 / 12.0 for of in channels), default=0.0)


def _levels(frequency_hz: Array, density: Array, white: Array, image: Array, period_s: float) -> Array:
    """Densities of both noises from the spectrum above the bandwidth, peaks left out."""
    low, high = BAND[0] * FILTER_HZ, min(BAND[1] * FILTER_HZ, 0.4 / period_s)
    if high < 1.2 * low:
        low, high = 0.25 / period_s, 0.45 / period_s
    band = (frequency_hz >= low) & (frequency_hz <= high) & (density > 0.0)
    levels = np.zeros(2)
    unit = np.array([of[band].mean() if of.any() else 1.0 for of in (white, image)]) if band.any() else levels
    for _ in range(6):
        if band.sum() < 4:
            break
        fitted = levels[0] * white + levels[1] * image
        weight = 1.0 / np.where(fitted > 0.0, fitted, density)[band]
        columns = np.stack((white[band] / unit[0], image[band] / unit[1]), axis=1) * weight[:, None]
        found, _ = nnls(columns, density[band] * weight)
        levels = found / unit
        band &= density < PEAK * (levels[0] * white + levels[1] * image) + 1e-300
    parts = np.stack((levels[0] * white, levels[1] * image))
    return levels * _lowest_octaves(frequency_hz, density, parts, high)


def _lowest_octaves(frequency_hz: Array, density: Array, parts: Array, high: float) -> Array:
    """Of each part, the smallest ratio of the spectrum to the sum of the parts where it is the larger one."""
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


def _pieces(values: Array, used: np.ndarray[Any, np.dtype[np.bool_]], n: int) -> list[Array]:
    """Stretches of n samples, all in use, half over one another."""
    runs = np.concatenate(([0], np.cumsum(used)))
    starts = range(0, len(values) - n + 1, n // 2)
    return [values[start : start + n] for start in starts if runs[start + n] - runs[start] == n]
