"""A load on a spring, seen from the motor: antiresonance, resonance, and the masses on either side.

    F = (Jm + Jl) a + Jl (H(s) - 1) a,   H(s) = (2 z w s + w2) / (s2 + 2 z w s + w2)

F force of the motor N, a its acceleration, Jm and Jl masses before and behind the spring kg, w antiresonance
rad/s (of the load, the motor held), z its damping ratio: the equations of motion of the load, solved for its
acceleration. Beside the rigid mass the term is linear in Jl; stiffness and damping are Jl w2 and 2 z Jl w.
Derivatives and H are discretised by the bilinear transform, as the state filter is.
"""

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize
from scipy.signal import lfilter, welch

from kernels.arrays import Array
from reconcile.catalogue.kinds import RegressionData, ShapeParameters
from reconcile.recording.gaussian_low_pass import gaussian_low_pass
from reconcile.recording.kinematics import gaussian_width_s

LOWEST_HZ, HIGHEST_HZ = 8.0, 120.0
"""Range of an antiresonance: below, gravity and friction resemble springs; above, the 60 Hz state filter
attenuates it to an eleventh."""
NYQUIST_SHARE = 0.5
"""Highest antiresonance over the Nyquist frequency: the bilinear transform is off by a quarter there."""
LEAST_EXCITED = 0.1
"""Least share of the acceleration's power near an antiresonance. Chosen: noise behind the low pass of the
kinematics has at most 0.25 %, a multisine nearly all."""
NEAR_RATIO = 1.5
"""Factor about an antiresonance within which power is near it; chosen."""
RATIO_OF_SCAN = 1.06
"""Ratio of neighbouring frequencies of the scan, half the width of a dip with `FIRST_DAMPING_RATIO`."""
FIRST_DAMPING_RATIO = 0.06
"""Damping ratio of the scan; the search after it changes it."""
DAMPING_RATIO_BOUNDS = (1e-3, 0.7)
LONGEST_S = 20.0
"""Total length of recordings for this search, s; more adds cost and little information. Chosen."""
MOST_EVALUATIONS = 120
"""Bounds the work of the search for frequency and damping."""
LOW_PASS_HZ = 60.0
"""Corner of the common low pass of force and columns: that of the state filter."""
SETTLED_S, END_S = 0.3, 0.02
"""Times at start and end of a recording that are not fitted; chosen."""
LEAST_GAIN = 0.2
"""Least share of the rigid model's squares that the spring explains, to be a candidate; chosen."""


def column(position_m: Array, period_s: float, frequency_hz: float, damping_ratio: float) -> Array:
    """Return the force of the motor per kilogram of load, beside that of a rigid load (n,)."""
    w = 2.0 * math.pi * frequency_hz
    b, a = _deflection_taps(w, damping_ratio, period_s)
    deflection_m = lfilter(b, a, position_m - position_m[0])
    damper = 2.0 * damping_ratio * w * np.gradient(deflection_m, period_s)
    spring: Array = w * w * deflection_m + damper
    return spring - _acceleration(position_m, period_s)


def transmission(force_hz: float, frequency_hz: float, damping_ratio: float) -> complex:
    """Return the force on the motor by a force on the load, the motor held: H at a frequency."""
    s, w = 1j * force_hz, frequency_hz
    passed = 2.0 * damping_ratio * w * s + w * w
    return passed / (s * s + passed)


def _deflection_taps(w: float, damping_ratio: float, period_s: float) -> tuple[Array, Array]:
    """Numerator and denominator of s2 / (s2 + 2 z w s + w2) by the bilinear transform, w in rad/s.

    Written out, because scipy's transform of polynomials takes milliseconds, and a search needs hundreds.
    """
    rate, damping = 2.0 / period_s, 2.0 * damping_ratio * w
    first = rate**2 + damping * rate + w**2
    b = np.array([1.0, -2.0, 1.0]) * (rate**2 / first)
    return b, np.array([1.0, 2.0 * (w**2 - rate**2) / first, (rate**2 - damping * rate + w**2) / first])


def _acceleration(position_m: Array, period_s: float) -> Array:
    """Second difference with the frequency response of the bilinear transform up to the fourth order (n,)."""
    second = np.zeros(len(position_m))
    second[1:-1] = np.diff(position_m, 2)
    fourth = np.zeros(len(position_m))
    fourth[2:-2] = np.diff(position_m, 4)
    difference: Array = (second - 0.25 * fourth) / period_s**2
    return difference


def highest_hz(datasets: Sequence[RegressionData]) -> float:
    """Highest antiresonance that these recordings and the filters show."""
    return min(HIGHEST_HZ, NYQUIST_SHARE * 0.5 / max(data.period_s for data in datasets))


def shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    """Frequency in Hz and damping ratio of the antiresonance; none where the recordings do not excite it."""
    period_s, top_hz = datasets[0].period_s, highest_hz(datasets)
    excited = [data for data in datasets if _excited_share(data, LOWEST_HZ, top_hz) >= LEAST_EXCITED]
    if top_hz <= LOWEST_HZ:
        return []
    parts, remaining_s = [], LONGEST_S
    for data in excited:
        count = min(len(data.time_s), int(remaining_s / period_s))
        if count * period_s >= 1.0:
            parts.append(_SmoothedStart(data, count))
        remaining_s -= count * period_s
    if not parts:
        return []

    def mean_square(logarithms: Array) -> float:
        frequency_hz, damping_ratio = (float(value) for value in np.exp(logarithms))
        lowest, highest = DAMPING_RATIO_BOUNDS
        if not LOWEST_HZ < frequency_hz < top_hz or not lowest < damping_ratio < highest:
            return math.inf
        return _fitted([one.with_spring(frequency_hz, damping_ratio) for one in parts])[0]

    count = math.ceil(math.log(top_hz / LOWEST_HZ) / math.log(RATIO_OF_SCAN))
    grid_hz = np.geomspace(LOWEST_HZ, top_hz, count)
    starts = [np.log([hz, FIRST_DAMPING_RATIO]) for hz in grid_hz[1:-1]]
    best = minimize(
        mean_square,
        min(starts, key=mean_square),
        method="Nelder-Mead",
        options={"maxfev": MOST_EVALUATIONS, "xatol": 1e-4, "fatol": 1e-12},
    )
    frequency_hz, damping_ratio = (float(value) for value in np.exp(best.x))
    squares, theta = _fitted([one.with_spring(frequency_hz, damping_ratio) for one in parts])
    rigid_squares, _ = _fitted([one.rigid() for one in parts])
    whole_kg, load_kg = theta[0], theta[-1]
    low_hz, high_hz = frequency_hz / NEAR_RATIO, frequency_hz * NEAR_RATIO
    is_excited = max(_excited_share(data, low_hz, high_hz) for data in excited) >= LEAST_EXCITED
    explains = squares <= (1.0 - LEAST_GAIN) * rigid_squares
    return [(frequency_hz, damping_ratio)] if explains and 0.0 < load_kg < whole_kg and is_excited else []


def _excited_share(data: RegressionData, low_hz: float, high_hz: float) -> float:
    """Share of the acceleration's power between two frequencies."""
    length = min(len(data.time_s), round(1.0 / data.period_s))
    hertz, power = welch(data.motion.acceleration_m_s2, 1.0 / data.period_s, nperseg=length)
    whole = float(power.sum())
    return float(power[(hertz >= low_hz) & (hertz <= high_hz)].sum()) / whole if whole > 0.0 else 0.0


class _SmoothedStart:
    """Smoothed force and columns of the first `count` samples of a recording: rigid, and with a spring."""

    def __init__(self, data: RegressionData, count: int) -> None:
        self._position_m, self._period_s = data.motion.position_m[:count], data.period_s
        corner_hz = min(LOW_PASS_HZ, data.motion.corner_hz)
        self._width = gaussian_width_s(corner_hz) / self._period_s
        # the ringing from before the recording has decayed; samples in between add no information
        every = max(int(1.0 / (self._period_s * 4.0 * HIGHEST_HZ)), 1)
        self._kept = np.arange(
            round(SETTLED_S / self._period_s), count - round(END_S / self._period_s), every
        )
        acceleration = _acceleration(self._position_m, self._period_s)
        velocity = np.gradient(self._position_m, self._period_s)
        direction = data.motion.direction[:count]
        self._rigid = self._smooth(np.stack((acceleration, velocity, direction, np.ones(count)), axis=1))
        self._force_n = self._smooth(data.force_n[:count])

    def _smooth(self, values: Array) -> Array:
        return gaussian_low_pass(values, self._width)[self._kept]

    def rigid(self) -> tuple[Array, Array]:
        """Force (m,) and columns (m, 4) of a rigid axis."""
        return self._force_n, self._rigid

    def with_spring(self, frequency_hz: float, damping_ratio: float) -> tuple[Array, Array]:
        """Force (m,) and columns (m, 5) with a load on a spring; the last column is the load's."""
        spring = self._smooth(column(self._position_m, self._period_s, frequency_hz, damping_ratio))
        return self._force_n, np.column_stack((self._rigid, spring))


def _fitted(parts: Sequence[tuple[Array, Array]]) -> tuple[float, Array]:
    """Mean square residual of a least-squares fit to all parts, and its coefficients (k,)."""
    y = np.concatenate([target for target, _ in parts])
    x = np.concatenate([columns for _, columns in parts])
    theta, *_ = np.linalg.lstsq(x, y, rcond=None)
    return float(np.mean((y - x @ theta) ** 2)), theta
