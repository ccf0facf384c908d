"""What lines are looked for, along what, and what a number of cycles a turn is to an engineer."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reconcile.locate_lines import Track, octaves
from reconcile.scenes import FILTER_HZ

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.locate_lines import Line
    from reconcile.model_file import NominalAxis
    from reconcile.rests import Rest

    Array = NDArray[np.float64]
    Index = NDArray[np.int64]

LOWEST_HZ, HIGHEST_HZ = 0.5, 2.0 * FILTER_HZ
LOWEST_ORDER, HIGHEST_ORDER = 0.45, 100.0
"""Cycles a turn."""
GRATING_ORDERS = (0.4, 4.2)
"""Cycles a grating period."""


class Pitches(NamedTuple):
    """What a turn holds; None = the model does not say."""

    lead_m: float
    pole_pairs: int | None
    grating_m: float | None


def pitches_of(axis: NominalAxis) -> Pitches:
    """Of a model file; not every one knows its motor's poles or the scale's grating."""
    return Pitches(axis.lead_m, axis.pole_pairs, axis.grating_m)


def order_bands(pitches: Pitches) -> list[tuple[float, float]]:
    """Cycles a turn that are looked at: those of screw and motor, and those of the scale's grating."""
    bands = octaves(LOWEST_ORDER, HIGHEST_ORDER)
    if pitches.grating_m is not None:
        turn = pitches.lead_m / pitches.grating_m
        low, high = (order * turn for order in GRATING_ORDERS)
        bands += octaves(max(low, HIGHEST_ORDER), high)
    return bands


def time_bands(rests: Sequence[Rest]) -> list[tuple[float, float]]:
    """Frequencies that are looked at."""
    return octaves(LOWEST_HZ, min(HIGHEST_HZ, 0.4 / max(rest.scene.period_s for rest in rests)))


def over_turns(rest: Rest, values: Array) -> Track:
    """The samples in use while it moves, over the turns of the screw."""
    m = rest.scene.motion
    used = rest.used & ~m.resting
    turns_s = np.abs(m.velocity_m_s[used]) / rest.scene.lead_m
    block = _blocks(rest)[used]
    return Track(values[used], m.position_m[used] / rest.scene.lead_m, turns_s, turns_s, block)


def over_time(rest: Rest, values: Array) -> Track:
    """The samples in use, over time."""
    used = rest.used
    same = np.ones(int(used.sum()))
    return Track(
        values[used], rest.scene.time_s[used], same, same * FILTER_HZ / HIGHEST_HZ, _blocks(rest)[used]
    )


def _blocks(rest: Rest) -> Index:
    return np.floor(rest.scene.time_s).astype(np.int64)


def named_order(line: Line, pitches: Pitches) -> str:
    """What a number of cycles a turn is, where the model tells what a turn holds."""
    within = [("turn", 1.0)]
    if pitches.pole_pairs is not None:
        within.append(("pole pair", float(pitches.pole_pairs)))
    if pitches.grating_m is not None:
        within.append(("grating period", pitches.lead_m / pitches.grating_m))
    for name, a_turn in reversed(within):
        times = line.wave / a_turn
        if round(times) >= 1 and abs(times - round(times)) * a_turn < max(line.width, 0.01 * a_turn):
            return f"{round(times)} a {name}"
    return ""
