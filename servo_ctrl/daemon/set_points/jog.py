"""Jogging: the operator moves axes at velocities that must be renewed, within the limits of each axis.

Within a cycle the acceleration of an axis is constant. The target velocity is bounded by the largest
velocity from which the axis can still stop before its software limit.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from servo_ctrl.daemon.set_points.reference import Row, StepSpan

ROUNDING = 1e-9
"""Tolerance of velocities, relative to the largest change in a cycle; chosen."""


STEP_CYCLES = 1 << 31
"""Renewal time of a step, in cycles: never over, because a step ends by its position."""


class JogLimits(NamedTuple):
    """Limits of one axis."""

    lowest_m: float
    highest_m: float
    velocity_m_s: float
    acceleration_m_s2: float


class Jog:
    """A `reference.Reference` from rest at `start_m` until all axes rest again and no motion is requested."""

    def __init__(
        self, start_m: Sequence[float], limits: Sequence[JogLimits], period_s: float, renewal_cycles: int
    ) -> None:
        self.ended = False
        self._limits, self._period_s, self._renewal = tuple(limits), period_s, renewal_cycles
        self._position_m = list(start_m)
        self._velocity_m_s = [0.0] * len(start_m)
        self._target_m_s = [0.0] * len(start_m)
        self._bounds = list(self._limits)
        """Limits of the present motion by axis; a step is bounded by its end position."""
        self._cycles_left = [0] * len(start_m)
        """By axis: cycles until the target velocity becomes 0 unless it is renewed."""

    @property
    def spans(self) -> list[StepSpan]:
        """Empty: jogging has no steps."""
        return []

    @property
    def step(self) -> int:
        """-1: jogging has no steps."""
        return -1

    def request_velocity(self, axis: int, velocity_m_s: float) -> None:
        """Move an axis at this velocity, within its limit, for the renewal time."""
        highest = self._limits[axis].velocity_m_s
        self._target_m_s[axis] = max(-highest, min(velocity_m_s, highest))
        self._cycles_left[axis] = self._renewal
        self._bounds[axis] = self._limits[axis]

    def request_step(self, axis: int, distance_m: float, velocity_m_s: float) -> str:
        """Move an axis by a distance, to rest; return why that is refused, else "".

        The distance bounds the motion, so it needs no renewal; a jog of the same axis replaces it.
        """
        if self._target_m_s[axis] or self._velocity_m_s[axis]:
            return "the axis is moving; wait until it has stopped"
        limits, start_m = self._limits[axis], self._position_m[axis]
        end_m = start_m + distance_m
        if not limits.lowest_m <= end_m <= limits.highest_m:
            return "the step leaves the travel"
        self._target_m_s[axis] = math.copysign(min(velocity_m_s, limits.velocity_m_s), distance_m)
        self._cycles_left[axis] = STEP_CYCLES
        self._bounds[axis] = limits._replace(lowest_m=min(start_m, end_m), highest_m=max(start_m, end_m))
        return ""

    def advance(self, cycle: int) -> Row | None:
        """Return the row of this cycle, None after the last one."""
        del cycle  # every cycle is the same
        if not any(self._velocity_m_s) and not any(self._target_m_s):
            self.ended = True
            return None
        row: Row = []
        for axis in range(len(self._limits)):
            row += self._move(axis)
        return row

    def _move(self, axis: int) -> tuple[float, float, float, float]:
        period_s, limits = self._period_s, self._bounds[axis]
        before_m, before_m_s = self._position_m[axis], self._velocity_m_s[axis]
        change_m_s = limits.acceleration_m_s2 * period_s
        highest = stoppable_m_s(limits.highest_m - before_m, before_m_s, change_m_s, period_s)
        lowest = -stoppable_m_s(before_m - limits.lowest_m, -before_m_s, change_m_s, period_s)
        target = max(lowest, min(self._target_m_s[axis], highest))
        velocity_m_s = max(before_m_s - change_m_s, min(target, before_m_s + change_m_s))
        if abs(target - velocity_m_s) < ROUNDING * change_m_s:
            velocity_m_s = target
        self._velocity_m_s[axis] = velocity_m_s
        self._position_m[axis] = before_m + 0.5 * (before_m_s + velocity_m_s) * period_s
        self._cycles_left[axis] -= 1
        if self._cycles_left[axis] <= 0 or (target == velocity_m_s == 0.0):  # not renewed, or at the limit
            self._target_m_s[axis] = 0.0
        return self._position_m[axis], velocity_m_s, (velocity_m_s - before_m_s) / period_s, 0.0


def stoppable_m_s(travel_m: float, before_m_s: float, change_m_s: float, period_s: float) -> float:
    """Return the largest velocity after the next period from which the axis stops within `travel_m`; >= 0.

    A velocity v stops in n = ceil(v / change) periods at constant deceleration, over v n T / 2. With the next
    period before it, v (n + 1) <= 2 travel / T - before.
    """
    budget_m_s = 2.0 * travel_m / period_s - before_m_s
    if budget_m_s <= 0.0:
        return 0.0
    periods = math.floor(0.5 * (math.sqrt(1.0 + 4.0 * budget_m_s / change_m_s) - 1.0))
    return max(periods * change_m_s, min((periods + 1) * change_m_s, budget_m_s / (periods + 2)))
