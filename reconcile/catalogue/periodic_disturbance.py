"""Periodic disturbance: a force A sin(2 pi f t), as of a pump, a fan or another machine.

The phase of a plant's disturbance counts from the start of the recording, as in an updated model.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.ndimage import median_filter

from hil_sim.physics.load import periodic_disturbance as physics
from kernels.arrays import Array
from reconcile.catalogue.entry import CatalogueEntry, Interval, PlausibleTerm
from reconcile.catalogue.kinds import OWN, RegressionData, ShapeParameters, TermFamily
from reconcile.catalogue.periodic import Wave, pair
from reconcile.catalogue.spring_behind_motor import transmission

LOWEST_HZ, HIGHEST_HZ = 0.3, 60.0
NYQUIST_SHARE = 0.8
"""Share of the Nyquist frequency above which a frequency is not distinguished from its alias."""
SEGMENTS, FEWEST_SEGMENTS = 8, 6
"""Segments of a recording in which a disturbance must have the same phase and amplitude."""
SEGMENT_PERIODS = 2.0
"""Least periods in a segment; with fewer its amplitude is indistinguishable from a drift."""
LEAST_COHERENCE = 0.6
"""Share of the squared amplitudes of the segments that one phase and amplitude have; a random force of one
recording exceeds it in 0.2 % of the cases (Beta distribution of 1 and 7)."""
LINE_HALF_WIDTH = 2.0
"""Half width of a spectral line, in inverse lengths of the recording: that of a Hann window."""
LEAST_MOTION_SHARE = 0.05
"""Share of the velocity's power in a line from which on it is a line of the motion, so that a force at that
frequency may follow from the motion. Chosen."""
COMB_RANGE = 3.0
"""Factor about a frequency within which lines of the motion are sought; chosen."""
LEAST_LINE_RATIO, LEAST_MEDIAN_RATIO = 0.02, 30.0
"""Least power of such a line over that at the frequency, and over the median about it: a random spectrum
exceeds its median thirtyfold in one of 1e9 places."""
TEETH, FEWEST_TEETH = np.array([-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0]), 4
"""Offsets of a comb's lines from a frequency, in their spacing, and the number of lines that make a comb."""
WEAK_SHARE, LEAST_ALONE = 0.01, 10.0
"""A line with a smaller share of the velocity's power is not of the motion if the residual's line has
LEAST_ALONE times the power of every other around it: a comb's residual has several lines. Chosen."""
PLAUSIBLE_HZ = 7.3
"""Frequency of a plausible disturbance: no multiple of a usual motion's."""
PEAKS = 8
"""Frequencies to try: the highest peaks over the spectrum around them."""
ZERO_PADDING = 4
"""Length of the transform over that of the longest recording."""
NEIGHBOURS = 101
"""Resolved frequencies around a peak whose median it is compared with."""
WAVE = Wave("frequency_hz", "Hz", "amplitude_n", "N")


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    period_s = datasets[0].period_s
    length = ZERO_PADDING * max(len(data.time_s) for data in datasets)
    power = np.zeros(length // 2 + 1)
    residuals_n = []
    for data in datasets:
        residual_n = np.where(data.motion.moving, data.force_n - data.model_force_n, 0.0)
        residual_n -= residual_n.mean()
        residuals_n.append(residual_n)
        power += np.abs(np.fft.rfft(residual_n * np.hanning(len(residual_n)), length)) ** 2
    frequency_hz = np.fft.rfftfreq(length, period_s)
    height = power / np.maximum(median_filter(power, ZERO_PADDING * NEIGHBOURS, mode="nearest"), 1e-300)
    highest_hz = min(HIGHEST_HZ, NYQUIST_SHARE * 0.5 / period_s)
    height[(frequency_hz < LOWEST_HZ) | (frequency_hz > highest_hz)] = 0.0
    peaks = np.flatnonzero((height[1:-1] > height[:-2]) & (height[1:-1] >= height[2:])) + 1
    highest = peaks[np.argsort(height[peaks])[::-1][:PEAKS]]
    peaks_hz = [_summit(power, int(peak)) / (length * period_s) for peak in highest]
    return [(f,) for f in peaks_hz if _is_apart_from_motion(datasets, residuals_n, f)]


def _summit(power: Array, peak: int) -> float:
    """Return the vertex of a parabola through the logarithms of a peak, in points of `power` (n,).

    Between two points of the transform a wave over the whole recording would lose 3 % of its amplitude, and
    leave a fifth of itself unexplained. The main lobe of a Hann window is that parabola within 0.01 points.
    """
    before, at, after = np.log(np.maximum(power[peak - 1 : peak + 2], 1e-300))
    curvature = before - 2.0 * at + after
    return peak + (float(np.clip(0.5 * (before - after) / curvature, -0.5, 0.5)) if curvature < 0.0 else 0.0)


def _intervals(
    values: Mapping[str, float], given: Mapping[str, Interval], datasets: Sequence[RegressionData]
) -> dict[str, Interval]:
    """The frequency's interval, Hz, by that of the amplitude and the longest recording; and the amplitude's.

    Source: the Cramer-Rao bounds of one tone in noise, var(omega) = 12 var(A) / (A T)^2 (Rife and Boorstyn
    1974, IEEE Trans. Inf. Theory 20, eq. 24 and 25). With a spring behind the motor, a force of one frequency
    may act on the load or on the motor: its amplitude is between what either takes.
    """
    longest_s = max(float(data.time_s[-1] - data.time_s[0]) for data in datasets)
    frequency_hz, (low_n, high_n) = values[WAVE.pitch], given["amplitude"]
    share = 0.5 * (high_n - low_n) / max(values["amplitude"], 1e-300)
    half_hz = math.sqrt(12.0) / (2.0 * math.pi) * share / longest_s
    of_motor = abs(_passed_on(datasets[0], frequency_hz))
    return {
        WAVE.pitch: (frequency_hz - half_hz, frequency_hz + half_hz),
        "amplitude": (min(low_n, of_motor * low_n), max(high_n, of_motor * high_n)),
    }


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    """Columns (n, 2) of a force on the load, which a spring in between passes on to the motor."""
    passed_on = _passed_on(data, shape[0])
    turned = np.array([[passed_on.real, passed_on.imag], [-passed_on.imag, passed_on.real]])
    columns: Array = pair(2.0 * np.pi * shape[0] * data.time_s) @ turned.T
    return columns


def _passed_on(data: RegressionData, frequency_hz: float) -> complex:
    return transmission(frequency_hz, *data.spring) if data.spring else 1.0 + 0.0j


def _is_apart_from_motion(
    datasets: Sequence[RegressionData], residuals_n: Sequence[Array], frequency_hz: float
) -> bool:
    """Whether a frequency is coherent in all recordings together, and in those without it in the motion.

    A disturbance moves a softly controlled axis, so its frequency may be in the motion too. If it is also
    there in a recording without it in the motion, then the motion is not its cause.
    """
    free_n = [
        residual_n
        for data, residual_n in zip(datasets, residuals_n, strict=True)
        if not _moves_at(data, residual_n, frequency_hz)
    ]
    period_s = datasets[0].period_s
    return all(_coherence(of, frequency_hz, period_s) >= LEAST_COHERENCE for of in (free_n, residuals_n))


def _moves_at(data: RegressionData, residual_n: Array, frequency_hz: float) -> bool:
    """Whether the motion has a spectral line at a frequency, alone or in a comb, as of a multisine.

    Evenly spaced lines are a comb: the axis responds to it at the comb's frequencies. A repeated scan is a
    comb too, but a single line of the residual does not come from it.
    """
    velocity_m_s = data.motion.velocity_m_s
    power = _power(velocity_m_s)
    hertz = np.fft.rfftfreq(len(velocity_m_s), data.period_s)
    width_hz = LINE_HALF_WIDTH / (len(velocity_m_s) * data.period_s)
    line = np.abs(hertz - frequency_hz) <= width_hz
    share = power[line].sum() / max(power.sum(), 1e-300)
    if share > LEAST_MOTION_SHARE:
        return True
    around = (hertz > frequency_hz / COMB_RANGE) & (hertz < frequency_hz * COMB_RANGE)
    if not around.any():
        return False
    if share < WEAK_SHARE:
        left, others = _power(residual_n), around & (np.abs(hertz - frequency_hz) > 2.0 * width_hz)
        if left[line].max() > LEAST_ALONE * left[others].max(initial=0.0):
            return False
    inner = power[1:-1]
    least = max(
        LEAST_LINE_RATIO * float(power[line].max()), LEAST_MEDIAN_RATIO * float(np.median(power[around]))
    )
    peaks = np.flatnonzero((inner > power[:-2]) & (inner > power[2:]) & around[1:-1] & (inner > least)) + 1
    lines_hz = hertz[peaks[~line[peaks]]]
    spacings_hz = np.abs(lines_hz - frequency_hz)
    found = (
        np.abs(lines_hz[:, None] - (frequency_hz + TEETH * spacing_hz)).min(axis=0, initial=np.inf)
        for spacing_hz in spacings_hz
    )
    return any(int((distance_hz <= width_hz).sum()) >= FEWEST_TEETH for distance_hz in found)


def _power(values: Array) -> Array:
    """Power (n / 2 + 1,) of the lines of a spectrum, through a Hann window."""
    return np.asarray(np.abs(np.fft.rfft(values * np.hanning(len(values)))) ** 2)


def _coherence(residuals_n: Sequence[Array], frequency_hz: float, period_s: float) -> float:
    """How alike the segments of each recording (n,) are at a frequency, 0 to 1; 0 where there are too few.

    A disturbance from outside keeps its phase and amplitude; a peak of a random force has them once.
    """
    one_phase = every_phase = 0.0
    for residual_n in residuals_n:
        periods = frequency_hz * period_s * len(residual_n)
        count = min(SEGMENTS, int(periods / SEGMENT_PERIODS))
        if count < FEWEST_SEGMENTS:
            continue
        turned = residual_n * np.exp(-2j * np.pi * frequency_hz * period_s * np.arange(len(residual_n)))
        own = np.array([segment.mean() for segment in np.array_split(turned, count)])
        one_phase += float(np.abs(own.mean()) ** 2)
        every_phase += float(np.mean(np.abs(own) ** 2))
    return one_phase / every_phase if every_phase > 0.0 else 0.0


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(_columns, _shapes, per_recording=OWN),),
    parameters_of=WAVE.parameters,
    intervals=_intervals,
    sentence=lambda p: (
        f"a force of {p['amplitude']:.2f} N at {p['frequency_hz']:.2f} Hz, fixed in time whatever the speed: "
        "a disturbance from outside; cogging would change its frequency with the speed"
    ),
    additive=True,
    to_plant=WAVE.to_plant,
    from_plant=WAVE.from_plant,
    shown_by="its frequency stays at any speed",
    plausible=lambda sizes: [PlausibleTerm((PLAUSIBLE_HZ,), (sizes.small_n, 0.0))],
    rank=12,
)
