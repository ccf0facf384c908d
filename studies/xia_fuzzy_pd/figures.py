"""Figures of a position law: overshoot and settling of a step, error and dead time of a sine.

Positions are those of the command and of the scale, metres, (n,) at the SYNC period. docs/fuzzy_pd.md
defines each.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array, rms
from servo_ctrl.learning.performance import reversals

SETTLED = 0.02
"""Half width of the settling band, as a share of the step; chosen."""
STANDING = 0.01
"""Below this share of the largest commanded speed the table counts as standing still."""
SPEED_SPAN_S = 0.01
"""Interval of the difference that gives the table speed: one count of the scale must not look like motion."""
COUNTED_FROM = 2
"""Reversals of a sine before the evaluated part, for the transient of the start."""


class StepFigures(NamedTuple):
    """The worse figures of a step up and the same step down."""

    overshoot_pct: float
    settling_s: float
    """NaN where it does not settle."""


class SineFigures(NamedTuple):
    """Figures of a sine from its third reversal to the last one."""

    rms_um: float
    peak_um: float
    dead_time_s: float
    """Time of standstill at a reversal, mean over the reversals."""


def step_figures(command_m: Array, scale_m: Array, period_s: float) -> StepFigures:
    """Return the figures of a command that steps and holds, once or more.

    Raises:
        ValueError: the command holds all the time.

    """
    moving = np.flatnonzero(np.diff(command_m, prepend=command_m[:1]))
    if len(moving) == 0:
        raise ValueError("the command has no step")
    begins = moving[np.diff(moving, prepend=-2) > 1]
    ends = [*begins[1:], len(command_m)]
    parts = [
        _one_step(command_m[begin - 1 : end], scale_m[begin:end], period_s)
        for begin, end in zip(begins, ends, strict=True)
    ]
    settling = [part.settling_s for part in parts]
    worst_s = math.nan if any(math.isnan(value) for value in settling) else max(settling)
    return StepFigures(max(part.overshoot_pct for part in parts), worst_s)


def _one_step(command_m: Array, scale_m: Array, period_s: float) -> StepFigures:
    """Return the figures of one step; `command_m` starts one sample before `scale_m`."""
    size_m = float(command_m[-1] - command_m[0])
    missing = (command_m[-1] - scale_m) / size_m
    outside = np.flatnonzero(np.abs(missing) > SETTLED)
    last = int(outside[-1]) + 1 if len(outside) else 0
    settling_s = math.nan if last == len(scale_m) else last * period_s
    return StepFigures(max(0.0, float(-np.min(missing)) * 100.0), settling_s)


def table_speed(position_m: Array, period_s: float) -> Array:
    """Return the velocity (n,), m/s, over `SPEED_SPAN_S` around each sample."""
    half = max(round(SPEED_SPAN_S / period_s / 2.0), 1)
    padded = np.pad(position_m, half, mode="edge")
    return np.asarray((padded[2 * half :] - padded[: -2 * half]) / (2 * half * period_s))


def sine_figures(command_m: Array, scale_m: Array, period_s: float) -> SineFigures:
    """Return the figures of a steady sine with ramps at its ends.

    Raises:
        ValueError: it has too few reversals.

    """
    turns = reversals(command_m)[COUNTED_FROM:]
    if len(turns) < 3:
        raise ValueError(f"the sine has {len(turns) + COUNTED_FROM} reversals; {COUNTED_FROM + 3} are needed")
    error_m = (command_m - scale_m)[turns[0] : turns[-1]]
    threshold_m_s = STANDING * float(np.max(np.abs(np.gradient(command_m[turns[0] : turns[-1]], period_s))))
    standstill = np.abs(table_speed(scale_m, period_s)) < threshold_m_s
    half_stroke = int(np.min(np.diff(turns))) // 2
    # the part of a reversal reaches half a stroke to either side
    standstills = [
        np.count_nonzero(standstill[turn - half_stroke : turn + half_stroke]) for turn in turns[:-1]
    ]
    return SineFigures(
        rms(error_m) * 1e6, float(np.max(np.abs(error_m))) * 1e6, float(np.mean(standstills)) * period_s
    )
