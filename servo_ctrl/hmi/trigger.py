"""What starts a picture of the scope: instants found in rows, however they are cut into blocks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from servo_ctrl.learning.performance import REST_M

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Indices = NDArray[np.int64]

Kind = Literal["free", "reversal", "rising", "falling", "fault"]
FAULT_BIT = 3
"""Of the statusword (CiA 402)."""


class Trigger(NamedTuple):
    """When a picture begins. `columns` are indices into a row."""

    kind: Kind = "free"
    columns: tuple[int, ...] = ()
    """The channel; the position command for a reversal, all statuswords for a fault."""
    level: float = 0.0
    """In the channel's SI unit; for rising and falling."""
    hysteresis: float = 0.0
    """So far beyond the level, on the other side, a value has to have been before it fires again."""


class Watch(NamedTuple):
    """What is remembered of the rows before."""

    value: float = np.nan
    """The last number of the channel; whether a fault was there; on which side of a level it was last."""
    direction: float = 0.0
    """Of the last motion of the command."""


def fired(trigger: Trigger, watch: Watch, rows: Array) -> tuple[Watch, Indices]:
    """Indices of the rows (n, channels) at which the trigger fires. A missing value fires nothing."""
    if trigger.kind == "free" or not len(rows) or not trigger.columns:
        return watch, np.zeros(0, dtype=np.int64)
    if trigger.kind == "fault":
        return _faults(trigger, watch, rows)
    values = rows[:, trigger.columns[0]]
    finite = np.flatnonzero(np.isfinite(values))
    if not len(finite):
        return watch, np.zeros(0, dtype=np.int64)
    here = values[finite]
    if trigger.kind == "reversal":
        return _reversals(watch, np.concatenate(([watch.value], here[:-1])), here, finite)
    return _levels(trigger, watch, here, finite)


def _levels(trigger: Trigger, watch: Watch, here: Array, place: Indices) -> tuple[Watch, Indices]:
    """The first number at the level or beyond it, after one on the other side by the hysteresis."""
    above = (here - trigger.level) * (1.0 if trigger.kind == "rising" else -1.0)
    side = np.where(above >= 0.0, 1.0, np.where(above < -trigger.hysteresis, -1.0, 0.0))
    side = np.concatenate(([np.nan_to_num(watch.value)], side))
    # between the two it is on the side where it was last
    latest = np.maximum.accumulate(np.where(side != 0.0, np.arange(len(side)), 0))
    side = side[latest]
    return Watch(float(side[-1])), place[(side[:-1] < 0.0) & (side[1:] > 0.0)]


def _reversals(watch: Watch, before: Array, here: Array, place: Indices) -> tuple[Watch, Indices]:
    """The first sample of each new direction, as `learning.performance.reversals` has it."""
    step_m = here - before
    moving = np.flatnonzero(np.abs(step_m) >= REST_M)  # not a number: no motion
    if not len(moving):
        return Watch(float(here[-1]), watch.direction), place[:0]
    direction = np.sign(step_m[moving])
    previous = np.concatenate(([watch.direction], direction[:-1]))
    turned = moving[direction * previous < 0.0]
    return Watch(float(here[-1]), float(direction[-1])), place[turned]


def _faults(trigger: Trigger, watch: Watch, rows: Array) -> tuple[Watch, Indices]:
    words = np.nan_to_num(rows[:, list(trigger.columns)]).astype(np.int64)
    faulty = np.bitwise_or.reduce(words, axis=1) >> FAULT_BIT & 1
    appeared = np.flatnonzero(np.diff(faulty, prepend=int(watch.value > 0.0)) > 0)
    return Watch(float(faulty[-1])), appeared
