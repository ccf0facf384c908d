"""Where model and recording differ: ranked by the share that a coordinate explains on blocks not looked at.

What is located is the difference that the model leaves once its values are fitted anew: what no value of the
nominal model explains. It is brought into phase with the motion first, for the filter makes it late.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from reconcile.locate_coordinates import coordinates
from reconcile.locate_lines import lines, of_the_motion
from reconcile.locate_pitches import named_order, order_bands, over_time, over_turns, pitches_of, time_bands
from reconcile.locate_share import Samples, joined, samples, share
from reconcile.scenes import FILTER_HZ
from reconcile.state_filter import ORDER

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Sense
    from reconcile.locate_coordinates import Coordinate
    from reconcile.locate_lines import Line
    from reconcile.locate_pitches import Pitches
    from reconcile.locate_share import Share
    from reconcile.model_file import NominalAxis
    from reconcile.rests import Rest

    Array = NDArray[np.float64]
    Index = NDArray[np.int64]

BULK = 0.8
"""So much of the excess is inside the range that is told."""


class Located(NamedTuple):
    """One coordinate; all in SI, the difference in N or m as its sense has it."""

    coordinate: str
    unit: str
    sense: Sense
    low: float
    high: float
    """Where most of the excess is."""
    share: float
    """Of the variance, on blocks left out of the mean; beyond the constant and the direction."""
    by_direction: bool
    """The difference changes its sign with the direction of motion; profile and peak are those forwards."""
    peak: float
    """Of the profile, or the amplitude of a line."""
    peak_at: float
    centres: Array
    profile: Array
    """Mean of the difference by bin; empty for a line."""
    errors: Array
    """Standard error of each mean."""
    labels: tuple[str, ...] = ()
    """Names of the bins, where they have some."""
    label: str = ""
    """The bin of the peak, or what a line is: `once a pole pair`."""


def locate(rests: Sequence[Rest], sense: Sense, axis: NominalAxis) -> list[Located]:
    """All coordinates that these recordings have, the one that explains most first."""
    values, pitches = [in_phase(rest, rest.refitted) for rest in rests], pitches_of(axis)
    given = samples(rests, values)
    given, found = _levels(given, sense)
    found += [_best(given, of, joined(of, rests), sense) for of in coordinates(rests, sense)]
    found += [_line("order", "1/turn", sense, line, pitches) for line in _orders(rests, values, pitches)]
    found += [_line("frequency", "Hz", sense, line, pitches) for line in _frequencies(rests, values)]
    return sorted(found, key=lambda one: -one.share)


def in_phase(rest: Rest, values: Array) -> Array:
    """Undo the delay of the state filter, at every frequency; how much it weakens stays."""
    period_s = rest.scene.period_s
    n = len(values)
    size = next_fast_len(n + 2 * math.ceil(12.0 / (2.0 * math.pi * FILTER_HZ) / period_s))
    warped = np.tan(np.minimum(math.pi * np.arange(size // 2 + 1) / size, 0.499 * math.pi))
    late = ORDER * np.arctan(2.0 * warped / (period_s * 2.0 * math.pi * FILTER_HZ))
    moved: Array = irfft(rfft(values, size) * np.exp(1j * late), size)[:n]
    return moved


def _orders(rests: Sequence[Rest], values: Sequence[Array], pitches: Pitches) -> list[Line]:
    tracks = [over_turns(rest, of) for rest, of in zip(rests, values, strict=True)]
    bands = order_bands(pitches)
    return lines(tracks, bands, [np.empty(0)] * len(bands))


def _frequencies(rests: Sequence[Rest], values: Sequence[Array]) -> list[Line]:
    tracks = [over_time(rest, of) for rest, of in zip(rests, values, strict=True)]
    barred = np.concatenate(
        [of_the_motion(rest.scene.motion.velocity_m_s, rest.scene.period_s) for rest in rests]
    )
    bands = time_bands(rests)
    return lines(tracks, bands, [barred[(barred > 0.9 * low) & (barred < 1.1 * high)] for low, high in bands])


def _best(given: Samples, coordinate: Coordinate, bins: Index, sense: Sense) -> Located:
    found = share(given, bins, coordinate.size, turned=False)
    if coordinate.both_ways:
        turned = share(given, bins, coordinate.size, turned=True)
        found = max(found, turned, key=lambda one: one.share)
    centres, (first, last), top = coordinate.centres, _range(found), _peak(found)
    return Located(
        coordinate.name,
        coordinate.unit,
        sense,
        float(coordinate.edges[first]),
        float(coordinate.edges[last + 1]),
        found.share,
        found.by_direction,
        float(found.mean[top]),
        float(centres[top]),
        centres,
        found.mean,
        found.errors,
        coordinate.labels,
        coordinate.labels[top] if coordinate.labels else "",
    )


def _peak(found: Share) -> int:
    """The bin with the largest mean that is not chance."""
    sure = np.abs(found.mean) - 2.0 * found.errors
    return int(np.argmax(np.where(found.counts > 0.0, sure, -np.inf)))


def _range(found: Share) -> tuple[int, int]:
    """The fewest neighbouring bins with the bulk of the excess, grown about the fullest one."""
    excess = found.counts * np.maximum(found.mean**2 - found.errors**2, 0.0)
    whole = float(excess.sum())
    first = last = int(np.argmax(excess))
    while whole > 0.0 and excess[first : last + 1].sum() < BULK * whole:
        before = excess[first - 1] if first > 0 else -1.0
        after = excess[last + 1] if last + 1 < len(excess) else -1.0
        first, last = (first - 1, last) if before > after else (first, last + 1)
    return (first, last) if whole > 0.0 else (0, len(excess) - 1)


def _levels(given: Samples, sense: Sense) -> tuple[Samples, list[Located]]:
    """Constant and direction, the larger first, and what is left: nothing else is to have them again."""
    everywhere, found = np.zeros(len(given.values), dtype=np.int64), []
    open_ones = {"constant": False, "direction": True}
    while open_ones:
        shares = {name: share(given, everywhere, 1, turned=turned) for name, turned in open_ones.items()}
        name = max(shares, key=lambda one: shares[one].share)
        level = shares[name]
        found.append(_level(name, sense, level))
        if level.share > 0.0:
            way = given.side if open_ones[name] else 1.0
            given = given._replace(values=given.values - level.mean[0] * way)
        del open_ones[name]
    return given, found


def _level(name: str, sense: Sense, found: Share) -> Located:
    nothing = np.empty(0)
    return Located(
        coordinate=name,
        unit="",
        sense=sense,
        low=0.0,
        high=0.0,
        share=found.share,
        by_direction=found.by_direction,
        peak=float(found.mean[0]),
        peak_at=0.0,
        centres=nothing,
        profile=nothing,
        errors=nothing,
    )


def _line(name: str, unit: str, sense: Sense, line: Line, pitches: Pitches) -> Located:
    nothing = np.empty(0)
    return Located(
        coordinate=name,
        unit=unit,
        sense=sense,
        low=max(line.wave - line.width, 0.0),
        high=line.wave + line.width,
        share=line.share,
        by_direction=False,
        peak=line.amplitude,
        peak_at=line.wave,
        centres=nothing,
        profile=nothing,
        errors=nothing,
        label=named_order(line, pitches) if name == "order" else "",
    )


def as_json(name: str, one: Located) -> dict[str, Any]:
    """An entry of `located` in verdict.json; a line's range is its width."""
    return {
        "axis": name,
        "sensor": one.sense.value,
        "coordinate": one.coordinate,
        "unit": one.unit,
        "range": [one.low, one.high],
        "share": one.share,
        "by_direction": one.by_direction,
        "peak": one.peak,
        "at": one.peak_at,
        "label": one.label,
    }
