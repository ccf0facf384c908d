"""Checks a program against the limits, using exactly the samples that would be commanded.

The check compares analytic velocity and acceleration and also the differences between samples, across the
joints of segments too, so that a discontinuous program fails.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.motion.profile import MotionLimits
from servo_ctrl.motion.program import Segment

ROUNDING = 1e-9
"""Share of a limit by which rounding may exceed it; chosen."""


class Violation(NamedTuple):
    """The first sample of a step beyond a limit; SI units."""

    step: int
    label: str
    axis: int
    quantity: str
    """position, velocity, acceleration, jerk or force offset."""
    value: float
    limit: float
    time_s: float
    """Time since the start of the step."""


def first_violation(
    program: Iterable[Segment], start_m: Array, limits: MotionLimits, period_s: float
) -> Violation | None:
    """Return the first violation, or None. The axes start at rest at `start_m` (axes,)."""
    position_m = np.asarray(start_m, dtype=np.float64)[np.newaxis]
    velocity_m_s = acceleration_m_s2 = np.zeros_like(position_m)
    for segment in program:
        x = np.concatenate((position_m, segment.position_m))
        v = np.concatenate((velocity_m_s, segment.velocity_m_s))
        a = np.concatenate((acceleration_m_s2, segment.acceleration_m_s2))
        # differences of positions lose digits: allow for the rounding of x / T
        lost_m_s = np.finfo(np.float64).eps * np.abs(x).max(initial=0.0) / period_s
        steps_m = np.diff(x, axis=0)
        steps_m_s = np.sign(steps_m) * np.maximum(np.abs(steps_m) / period_s - lost_m_s, 0.0)
        symmetric = (
            ("velocity", segment.velocity_m_s, limits.velocity_m_s),
            ("velocity", steps_m_s, limits.velocity_m_s),
            ("acceleration", segment.acceleration_m_s2, limits.acceleration_m_s2),
            ("acceleration", np.diff(v, axis=0) / period_s, limits.acceleration_m_s2),
            ("jerk", np.diff(a, axis=0) / period_s, limits.jerk_m_s3),
            ("force offset", segment.force_offset_n, limits.force_n),
        )
        for quantity, values, lowest, highest in (
            ("position", segment.position_m, limits.position_min_m, limits.position_max_m),
            *((quantity, values, -limit, limit) for quantity, values, limit in symmetric),
        ):
            found = _worst(values, lowest, highest)
            if found is not None:
                row, axis, limit = found
                time_s = (segment.first_sample + row + 1) * period_s
                value = float(values[row, axis])
                return Violation(
                    step=segment.step,
                    label=segment.label,
                    axis=axis,
                    quantity=quantity,
                    value=value,
                    limit=limit,
                    time_s=time_s,
                )
        position_m, velocity_m_s, acceleration_m_s2 = x[-1:], v[-1:], a[-1:]
    return None


def stop_at_the_end(last: Segment) -> Segment:
    """Return one more sample, at rest at the end of `last`, so that a program that ends in motion fails."""
    rest = np.zeros_like(last.velocity_m_s[:1])
    return last._replace(
        position_m=last.position_m[-1:],
        velocity_m_s=rest,
        acceleration_m_s2=rest,
        force_offset_n=rest,
        first_sample=last.first_sample + len(last.position_m),
        steady=(0, 0),
    )


def _worst(values: Array, lowest: Array, highest: Array) -> tuple[int, int, float] | None:
    """Return row, axis and limit of the value farthest beyond; None if all are within."""
    if not len(values):
        return None
    slack = ROUNDING * (highest - lowest)
    # written so that a NaN counts as beyond
    beyond = ~((values >= lowest - slack) & (values <= highest + slack))
    if not beyond.any():
        return None
    excess = np.nan_to_num(np.maximum(lowest - values, values - highest), nan=np.inf)
    excess[~beyond] = -np.inf
    row, axis = (int(i) for i in np.unravel_index(int(np.argmax(excess)), excess.shape))
    below = values[row, axis] < lowest[axis]
    return row, axis, float(lowest[axis] if below else highest[axis])
