"""Coordinates over which a residual is averaged: the bin of every sample, by recording.

All come from the sensors and the motion; none depends on which effect is missing. Bins are linear, or
logarithmic where small values matter as much as large ones; each phase and each recording is one bin.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array, Index
from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.regression.residual import Residual

BINS = 24
"""Bins of a coordinate; chosen."""
SLOW_BINS = 6
"""For coordinates that change slowly (run time, temperature): several blocks must fall into each bin."""
TAIL_PERCENT = 0.5
"""Percentage of the samples beyond either end of the bins; they are put into the outermost bins."""
PHASES = ("standstill", "breakaway", "reversal", "constant speed", "acceleration")
PHASE_S = 0.1
"""Length of the phases breakaway (after a standstill) and reversal (without a standstill), s; chosen."""
LEAST_ACCELERATION_SHARE = 0.1
"""Least acceleration of the phase of that name, as a share of the 99th percentile; chosen."""
SHORTEST_DISTANCE_M = 1e-7
"""Shorter distances since the reversal are in the first bin."""
NO_START = -(10**9)
"""Sample index of a start that never was: far enough before the first sample that no phase reaches it."""


class Coordinate(NamedTuple):
    """One coordinate of all recordings."""

    name: str
    unit: str
    edges: Array
    """(bins + 1,), finite."""
    bins: list[Index]
    """By recording, the bin of each sample (n,); -1 where the coordinate has no value."""
    has_direction: bool = True
    """Whether the residual times the direction of motion is averaged too."""
    logarithmic: bool = False
    labels: tuple[str, ...] = ()
    """Names of the bins, if they have any."""

    @property
    def size(self) -> int:
        """Number of bins."""
        return len(self.edges) - 1

    @property
    def centres(self) -> Array:
        """Middles of the bins; geometric means where they are logarithmic."""
        low, high = self.edges[:-1], self.edges[1:]
        middle: Array = np.sqrt(low * high) if self.logarithmic else 0.5 * (low + high)
        return middle


def coordinates(residuals: Sequence[Residual], channel: ResidualChannel) -> list[Coordinate]:
    """Every coordinate that all recordings have and that has more than one bin."""
    datasets, used = [residual.data for residual in residuals], [residual.used for residual in residuals]

    def by_recording(quantity: Callable[[RegressionData], Array]) -> list[Array]:
        return [quantity(data) for data in datasets]

    slowest_m_s = max(data.motion.velocity_threshold_m_s for data in datasets)
    is_force = channel is ResidualChannel.FORCE
    velocity_m_s = by_recording(lambda data: data.motion.velocity_m_s)
    since_reversal_m = by_recording(lambda data: data.motion.distance_since_reversal_m)
    binned = [
        _linear("run_time", "s", by_recording(lambda data: data.time_s), used, SLOW_BINS),
        _labelled("motion_phase", [phases(data) for data in datasets], PHASES),
        _linear("position", "m", by_recording(lambda data: data.motion.position_m), used),
        _linear("velocity", "m/s", velocity_m_s, used, has_direction=False),
        _logarithmic("speed", "m/s", velocity_m_s, used, slowest_m_s),
        _linear("acceleration", "m/s^2", by_recording(lambda data: data.motion.acceleration_m_s2), used),
        _linear("force", "N", by_recording(lambda data: data.model_force_n), used, has_direction=is_force),
        _logarithmic("distance_since_reversal", "m", since_reversal_m, used, SHORTEST_DISTANCE_M),
    ]
    if len(residuals) > 1:
        numbers = [np.full(len(residual.used), number) for number, residual in enumerate(residuals)]
        binned.append(_labelled("recording", numbers, tuple(residual.source for residual in residuals)))
    temperature_k = [data.temperature_k for data in datasets if data.temperature_k is not None]
    if len(temperature_k) == len(datasets):
        binned.append(_linear("temperature", "K", temperature_k, used, SLOW_BINS))
    for other_axis in sorted(set.intersection(*(set(data.others) for data in datasets))):
        position_m = [data.others[other_axis].position_m for data in datasets]
        binned.append(_linear(f"position_of_{other_axis}", "m", position_m, used))
    return [coordinate for coordinate in binned if coordinate.size > 1]


def phases(data: RegressionData) -> Index:
    """Phase of motion of each sample (n,), as an index into PHASES."""
    motion, n = data.motion, len(data.time_s)
    reversals = np.flatnonzero(np.diff(motion.last_direction) != 0.0) + 1
    breakaways = np.flatnonzero(np.diff(motion.standing_still.astype(np.int8)) < 0) + 1
    phase_samples = max(round(PHASE_S / data.period_s), 1)
    acceleration_m_s2 = np.abs(motion.acceleration_m_s2)
    accelerating = acceleration_m_s2 > LEAST_ACCELERATION_SHARE * np.percentile(acceleration_m_s2, 99.0)
    phase = np.where(accelerating, PHASES.index("acceleration"), PHASES.index("constant speed"))
    for starts, name in ((reversals, "reversal"), (breakaways, "breakaway")):
        samples_since_start = np.arange(n) - _latest_start(starts, n)
        phase[samples_since_start < phase_samples] = PHASES.index(name)
    phase[motion.standing_still] = PHASES.index("standstill")
    return phase


def _latest_start(starts: Index, n: int) -> Index:
    """Index of the latest start at or before each sample, (n,); NO_START where there is none."""
    latest = np.full(n, NO_START)
    latest[starts] = starts
    return np.maximum.accumulate(latest)


def _linear(
    name: str,
    unit: str,
    values: list[Array],
    used: list[NDArray[np.bool_]],
    bins: int = BINS,
    *,
    has_direction: bool = True,
) -> Coordinate:
    """A coordinate with bins of equal width; without bins if its `values`, by recording, are all alike."""
    in_use = np.concatenate([of[counted] for of, counted in zip(values, used, strict=True)])
    in_use = in_use[np.isfinite(in_use)]
    if not len(in_use) or np.ptp(in_use) <= 0.0:
        return Coordinate(name, unit, np.zeros(1), [], has_direction)
    low, high = np.percentile(in_use, [TAIL_PERCENT, 100.0 - TAIL_PERCENT])
    if high <= low:
        low, high = in_use.min(), in_use.max()
    bin_of_sample = [_bin_of(of, low, high, bins) for of in values]
    return Coordinate(name, unit, np.linspace(low, high, bins + 1), bin_of_sample, has_direction)


def _logarithmic(
    name: str, unit: str, values: list[Array], used: list[NDArray[np.bool_]], smallest: float
) -> Coordinate:
    """A coordinate with logarithmic bins of its size, from `smallest` on; without bins if all are smaller."""
    sizes = (np.abs(of[counted]) for of, counted in zip(values, used, strict=True))
    largest = max(float(size.max(initial=0.0)) for size in sizes)
    if largest <= 2.0 * smallest:
        return Coordinate(name, unit, np.zeros(1), [])
    low, high = np.log10(smallest), np.log10(largest)
    bins = [_bin_of(np.log10(np.maximum(np.abs(of), smallest)), low, high, BINS) for of in values]
    return Coordinate(name, unit, np.logspace(low, high, BINS + 1), bins, logarithmic=True)


def _labelled(name: str, bins: list[Index], labels: tuple[str, ...]) -> Coordinate:
    return Coordinate(name, "", np.arange(len(labels) + 1.0) - 0.5, bins, labels=labels)


def _bin_of(values: Array, low: float, high: float, bins: int) -> Index:
    """The bin of each value (n,), the outermost beyond `low` and `high`; -1 where it is not finite."""
    finite = np.isfinite(values)
    position = (np.where(finite, values, low) - low) * (bins / (high - low))
    return np.where(finite, np.clip(position.astype(np.int64), 0, bins - 1), -1)
