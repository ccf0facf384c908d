"""Finds the rows that trigger the scope, the same rows however they are divided into blocks."""

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from servo_ctrl.learning.performance import REST_M

Indices = NDArray[np.int64]

TriggerKind = Literal["free", "reversal", "rising", "falling", "fault"]
FAULT_BIT = 3
"""Bit of the statusword (CiA 402)."""


class Trigger(NamedTuple):
    """What triggers the scope."""

    kind: TriggerKind = "free"
    columns: tuple[int, ...] = ()
    """Columns of a row: the channel; the position command for a reversal; all statuswords for a fault."""
    level: float = 0.0
    """Of a rising or falling trigger, in the SI unit of the channel."""
    hysteresis: float = 0.0
    """A value must have been this far on the other side of the level before it triggers again."""


class TriggerState(NamedTuple):
    """What is remembered of the earlier rows."""

    value: float = np.nan
    """Reversal: the last command. Level: the side it was on last, -1 or 1. Fault: 1 when there was one."""
    direction: float = 0.0
    """Of the last motion of the command."""


def find_triggers(trigger: Trigger, state: TriggerState, rows: Array) -> tuple[TriggerState, Indices]:
    """Return the next state and the indices of the rows (n, channels) that trigger; NaN never does."""
    if trigger.kind == "free" or not len(rows) or not trigger.columns:
        return state, np.zeros(0, dtype=np.int64)
    if trigger.kind == "fault":
        return _faults(trigger, state, rows)
    values = rows[:, trigger.columns[0]]
    finite = np.flatnonzero(np.isfinite(values))
    if not len(finite):
        return state, np.zeros(0, dtype=np.int64)
    if trigger.kind == "reversal":
        return _reversals(state, values[finite], finite)
    return _level_crossings(trigger, state, values[finite], finite)


def _level_crossings(
    trigger: Trigger, state: TriggerState, values: Array, place: Indices
) -> tuple[TriggerState, Indices]:
    """Return the first value at the level or beyond it, after one on the other side by the hysteresis."""
    above = (values - trigger.level) * (1.0 if trigger.kind == "rising" else -1.0)
    side = np.where(above >= 0.0, 1.0, np.where(above < -trigger.hysteresis, -1.0, 0.0))
    side = np.concatenate(([np.nan_to_num(state.value)], side))
    # within the hysteresis a value stays on the side where it was last
    latest = np.maximum.accumulate(np.where(side != 0.0, np.arange(len(side)), 0))
    side = side[latest]
    return TriggerState(float(side[-1])), place[(side[:-1] < 0.0) & (side[1:] > 0.0)]


def _reversals(state: TriggerState, command_m: Array, place: Indices) -> tuple[TriggerState, Indices]:
    """Return the first sample of each new direction, as in `learning.performance.reversals`."""
    step_m = np.diff(command_m, prepend=state.value)
    moving = np.flatnonzero(np.abs(step_m) >= REST_M)  # false for NaN: the first row ever moves nowhere
    if not len(moving):
        return TriggerState(float(command_m[-1]), state.direction), place[:0]
    direction = np.sign(step_m[moving])
    previous = np.concatenate(([state.direction], direction[:-1]))
    turned = moving[direction * previous < 0.0]
    return TriggerState(float(command_m[-1]), float(direction[-1])), place[turned]


def _faults(trigger: Trigger, state: TriggerState, rows: Array) -> tuple[TriggerState, Indices]:
    words = np.nan_to_num(rows[:, list(trigger.columns)]).astype(np.int64)
    faulty = np.bitwise_or.reduce(words, axis=1) >> FAULT_BIT & 1
    appeared = np.flatnonzero(np.diff(faulty, prepend=int(state.value > 0.0)) > 0)
    return TriggerState(float(faulty[-1])), appeared
