"""Coordinates that a difference can live in: of every sample its bin, by recording.

All are taken from the sensors and the motion; none knows what was left out. Bins are even, or even in the
logarithm where small values matter as much as large ones; phases and recordings are bins of their own.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reconcile.catalogue.kinds import Sense

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene
    from reconcile.rests import Rest

    Array = NDArray[np.float64]
    Index = NDArray[np.int64]

BINS = 24
SLOW_BINS = 6
"""Over what goes on slowly: several blocks must fall into each."""
TAILS_PERCENT = 0.5
"""So much of the samples on either side is counted to the outermost bins."""
PHASES = ("standstill", "breakaway", "reversal", "constant speed", "acceleration")
AFTER_S = 0.1
"""So long after a rest is breakaway, after a turn without a rest reversal."""
HARD = 0.1
"""Share of the greatest acceleration from which on it is one."""
SMALLEST_M = 1e-7
"""Ways below are one bin."""


class Coordinate(NamedTuple):
    """One coordinate of all recordings. `edges` (bins + 1,) are NaN-free; with `labels` a bin has a name."""

    name: str
    unit: str
    edges: Array
    bins: list[Index]
    """By recording, (n,); -1 where the coordinate has no value."""
    both_ways: bool
    """Whether it makes sense to turn the difference round with the direction of motion."""
    logarithmic: bool = False
    labels: tuple[str, ...] = ()

    @property
    def size(self) -> int:
        """Number of bins."""
        return len(self.edges) - 1

    @property
    def centres(self) -> Array:
        """Middles of the bins, the geometric ones where they are logarithmic."""
        low, high = self.edges[:-1], self.edges[1:]
        middle: Array = np.sqrt(low * high) if self.logarithmic else 0.5 * (low + high)
        return middle


def coordinates(rests: Sequence[Rest], sense: Sense) -> list[Coordinate]:
    """All that these recordings have."""
    scenes, used = [rest.scene for rest in rests], [rest.used for rest in rests]

    def even(
        name: str, unit: str, of: Callable[[Scene], Array], bins: int = BINS, *, both_ways: bool = True
    ) -> Coordinate:
        return _even(name, unit, [of(scene) for scene in scenes], used, bins, both_ways=both_ways)

    def logarithmic(name: str, unit: str, of: Callable[[Scene], Array], smallest: float) -> Coordinate:
        return _logarithmic(name, unit, [of(scene) for scene in scenes], used, smallest)

    creep_m_s = max(scene.motion.creep_m_s for scene in scenes)
    found = [
        even("run_time", "s", lambda scene: scene.time_s, SLOW_BINS),
        _labelled("motion_phase", [phases(scene) for scene in scenes], PHASES, both_ways=True),
        even("position", "m", lambda scene: scene.motion.position_m),
        even("velocity", "m/s", lambda scene: scene.motion.velocity_m_s, both_ways=False),
        logarithmic("speed", "m/s", lambda scene: scene.motion.velocity_m_s, creep_m_s),
        even("acceleration", "m/s^2", lambda scene: scene.motion.acceleration_m_s2),
        even("force", "N", lambda scene: scene.model_force_n, both_ways=sense is Sense.FORCE),
        logarithmic("distance_since_reversal", "m", lambda s: s.motion.since_reversal_m, SMALLEST_M),
    ]
    if len(rests) > 1:
        own = [np.full(len(rest.used), index) for index, rest in enumerate(rests)]
        found.append(_labelled("recording", own, tuple(rest.source for rest in rests), both_ways=True))
    if all(scene.temperature_k is not None for scene in scenes):
        warm = [scene.temperature_k for scene in scenes if scene.temperature_k is not None]
        found.append(_even("temperature", "K", warm, used, SLOW_BINS, both_ways=True))
    for other in sorted(set.intersection(*(set(scene.others) for scene in scenes))):
        ways = [scene.others[other].position_m for scene in scenes]
        found += [_even(f"position_of_{other}", "m", ways, used, BINS, both_ways=True)]
    return [coordinate for coordinate in found if coordinate.size > 1]


def phases(scene: Scene) -> Index:
    """(n,) places in PHASES."""
    m = scene.motion
    n = len(scene.time_s)
    turned = np.flatnonzero(np.diff(m.last_direction) != 0.0) + 1
    started = np.flatnonzero(np.diff(m.resting.astype(np.int8)) < 0) + 1
    span = max(round(AFTER_S / scene.period_s), 1)
    size = np.abs(m.acceleration_m_s2)
    hard = size > HARD * np.percentile(size, 99.0)
    found = np.where(hard, PHASES.index("acceleration"), PHASES.index("constant speed"))
    for starts, name in ((turned, "reversal"), (started, "breakaway")):
        ages = np.arange(n) - _last(starts, n)
        found[ages < span] = PHASES.index(name)
    found[m.resting] = PHASES.index("standstill")
    return found


def _last(starts: Index, n: int) -> Index:
    """Of every sample the last start at or before it; long ago where there was none."""
    marks = np.full(n, -(10**9))
    marks[starts] = starts
    return np.maximum.accumulate(marks)


def _even(
    name: str, unit: str, values: list[Array], used: list[NDArray[np.bool_]], bins: int, *, both_ways: bool
) -> Coordinate:
    counted = np.concatenate([of[use] for of, use in zip(values, used, strict=True)])
    counted = counted[np.isfinite(counted)]
    if not len(counted) or np.ptp(counted) <= 0.0:
        return Coordinate(name, unit, np.zeros(1), [], both_ways)
    low, high = np.percentile(counted, [TAILS_PERCENT, 100.0 - TAILS_PERCENT])
    if high <= low:
        low, high = counted.min(), counted.max()
    places = [_places(of, low, high, bins) for of in values]
    return Coordinate(name, unit, np.linspace(low, high, bins + 1), places, both_ways)


def _logarithmic(
    name: str, unit: str, values: list[Array], used: list[NDArray[np.bool_]], smallest: float
) -> Coordinate:
    largest = max((float(np.abs(of[use]).max(initial=0.0)) for of, use in zip(values, used, strict=True)))
    if largest <= 2.0 * smallest:
        return Coordinate(name, unit, np.zeros(1), [], both_ways=True)
    low, high = np.log10(smallest), np.log10(largest)
    bins = [_places(np.log10(np.maximum(np.abs(of), smallest)), low, high, BINS) for of in values]
    return Coordinate(name, unit, np.logspace(low, high, BINS + 1), bins, both_ways=True, logarithmic=True)


def _labelled(name: str, bins: list[Index], labels: tuple[str, ...], *, both_ways: bool) -> Coordinate:
    return Coordinate(name, "", np.arange(len(labels) + 1.0) - 0.5, bins, both_ways, labels=labels)


def _places(values: Array, low: float, high: float, bins: int) -> Index:
    finite = np.isfinite(values)
    place = (np.where(finite, values, low) - low) * (bins / (high - low))
    return np.where(finite, np.clip(place.astype(np.int64), 0, bins - 1), -1)
