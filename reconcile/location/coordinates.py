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
SLOW_BINS = 6
"""For coordinates that change slowly (run time, temperature): several blocks must fall into each bin."""
TAILS_PERCENT = 0.5
"""Share of the samples beyond each end of the bins; they count to the outermost bins."""
PHASES = ("standstill", "breakaway", "reversal", "constant speed", "acceleration")
PHASE_S = 0.1
"""Length of the phases breakaway (after a standstill) and reversal (after a turn without one), s."""
LEAST_ACCELERATION_SHARE = 0.1
"""Least acceleration of the phase of that name, as a share of the 99th percentile."""
SHORTEST_DISTANCE_M = 1e-7
"""Shorter distances since the reversal are in the first bin."""


class Coordinate(NamedTuple):
    """One coordinate of all recordings. `edges` (bins + 1,) are NaN-free; `labels` name the bins, if any."""

    name: str
    unit: str
    edges: Array
    bins: list[Index]
    """By recording, (n,); -1 where the coordinate has no value."""
    has_direction: bool = True
    """Whether the residual times the direction of motion is averaged too."""
    logarithmic: bool = False
    labels: tuple[str, ...] = ()

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
    """Every coordinate that these recordings have and that has more than one bin."""
    datasets, used = [residual.data for residual in residuals], [residual.used for residual in residuals]

    def of(function: Callable[[RegressionData], Array]) -> list[Array]:
        return [function(data) for data in datasets]

    slowest_m_s = max(data.motion.velocity_threshold_m_s for data in datasets)
    is_force = channel is ResidualChannel.FORCE
    velocity_m_s = of(lambda data: data.motion.velocity_m_s)
    since_reversal_m = of(lambda data: data.motion.distance_since_reversal_m)
    found = [
        _even("run_time", "s", of(lambda data: data.time_s), used, SLOW_BINS),
        _labelled("motion_phase", [phases(data) for data in datasets], PHASES),
        _even("position", "m", of(lambda data: data.motion.position_m), used),
        _even("velocity", "m/s", velocity_m_s, used, has_direction=False),
        _logarithmic("speed", "m/s", velocity_m_s, used, slowest_m_s),
        _even("acceleration", "m/s^2", of(lambda data: data.motion.acceleration_m_s2), used),
        _even("force", "N", of(lambda data: data.model_force_n), used, has_direction=is_force),
        _logarithmic("distance_since_reversal", "m", since_reversal_m, used, SHORTEST_DISTANCE_M),
    ]
    if len(residuals) > 1:
        own = [np.full(len(residual.used), index) for index, residual in enumerate(residuals)]
        found.append(_labelled("recording", own, tuple(residual.source for residual in residuals)))
    temperature_k = [data.temperature_k for data in datasets if data.temperature_k is not None]
    if len(temperature_k) == len(datasets):
        found.append(_even("temperature", "K", temperature_k, used, SLOW_BINS))
    for other in sorted(set.intersection(*(set(data.others) for data in datasets))):
        positions_m = [data.others[other].position_m for data in datasets]
        found.append(_even(f"position_of_{other}", "m", positions_m, used))
    return [coordinate for coordinate in found if coordinate.size > 1]


def phases(data: RegressionData) -> Index:
    """Phase of motion of each sample (n,), as an index into PHASES."""
    m = data.motion
    n = len(data.time_s)
    turned = np.flatnonzero(np.diff(m.last_direction) != 0.0) + 1
    started = np.flatnonzero(np.diff(m.standing_still.astype(np.int8)) < 0) + 1
    span = max(round(PHASE_S / data.period_s), 1)
    size = np.abs(m.acceleration_m_s2)
    accelerating = size > LEAST_ACCELERATION_SHARE * np.percentile(size, 99.0)
    found = np.where(accelerating, PHASES.index("acceleration"), PHASES.index("constant speed"))
    for starts, name in ((turned, "reversal"), (started, "breakaway")):
        ages = np.arange(n) - _latest_start(starts, n)
        found[ages < span] = PHASES.index(name)
    found[m.standing_still] = PHASES.index("standstill")
    return found


def _latest_start(starts: Index, n: int) -> Index:
    """Index of the latest start at or before each sample, (n,); far negative where there is none."""
    marks = np.full(n, -(10**9))
    marks[starts] = starts
    return np.maximum.accumulate(marks)


def _even(
    name: str,
    unit: str,
    values: list[Array],
    used: list[NDArray[np.bool_]],
    bins: int = BINS,
    *,
    has_direction: bool = True,
) -> Coordinate:
    counted = np.concatenate([of[use] for of, use in zip(values, used, strict=True)])
    counted = counted[np.isfinite(counted)]
    if not len(counted) or np.ptp(counted) <= 0.0:
        return Coordinate(name, unit, np.zeros(1), [], has_direction)
    low, high = np.percentile(counted, [TAILS_PERCENT, 100.0 - TAILS_PERCENT])
    if high <= low:
        low, high = counted.min(), counted.max()
    places = [_bin_of(of, low, high, bins) for of in values]
    return Coordinate(name, unit, np.linspace(low, high, bins + 1), places, has_direction)


def _logarithmic(
    name: str, unit: str, values: list[Array], used: list[NDArray[np.bool_]], smallest: float
) -> Coordinate:
    largest = max((float(np.abs(of[use]).max(initial=0.0)) for of, use in zip(values, used, strict=True)))
    if largest <= 2.0 * smallest:
        return Coordinate(name, unit, np.zeros(1), [])
    low, high = np.log10(smallest), np.log10(largest)
    bins = [_bin_of(np.log10(np.maximum(np.abs(of), smallest)), low, high, BINS) for of in values]
    return Coordinate(name, unit, np.logspace(low, high, BINS + 1), bins, logarithmic=True)


def _labelled(name: str, bins: list[Index], labels: tuple[str, ...]) -> Coordinate:
    return Coordinate(name, "", np.arange(len(labels) + 1.0) - 0.5, bins, labels=labels)


def _bin_of(values: Array, low: float, high: float, bins: int) -> Index:
    finite = np.isfinite(values)
    place = (np.where(finite, values, low) - low) * (bins / (high - low))
    return np.where(finite, np.clip(place.astype(np.int64), 0, bins - 1), -1)
