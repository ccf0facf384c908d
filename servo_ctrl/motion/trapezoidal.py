"""Trapezoidal velocity: constant acceleration, cruise, constant deceleration; a triangle if short.

Also there-and-back moves of one axis, the trajectories S1-S4 of Feng et al. 2015 (section 5): the
deceleration continues through zero velocity into the return stroke, so that the reversal has no dwell and
the reverse acceleration is that of the ramps.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.motion.profile import Motion, Profile, resting


class Trapezoid(NamedTuple):
    """Path length over time; all SI, `ramp_s` > 0, `cruise_s` >= 0."""

    distance_m: float
    speed_m_s: float
    ramp_s: float
    cruise_s: float

    @property
    def duration_s(self) -> float:
        """Duration of both ramps and the cruise."""
        return 2.0 * self.ramp_s + self.cruise_s

    def travelled(self, time_s: Array) -> tuple[Array, Array, Array]:
        """Return length m, speed m/s and acceleration m/s^2 at 0 <= t <= duration, each (n,)."""
        acceleration = self.speed_m_s / self.ramp_s
        left_s = self.duration_s - time_s
        rising = time_s < self.ramp_s
        falling = ~rising & (left_s <= self.ramp_s)
        length_m = self.speed_m_s * (time_s - 0.5 * self.ramp_s)
        speed_m_s = np.full_like(time_s, self.speed_m_s)
        length_m[rising] = 0.5 * acceleration * time_s[rising] ** 2
        speed_m_s[rising] = acceleration * time_s[rising]
        length_m[falling] = self.distance_m - 0.5 * acceleration * left_s[falling] ** 2
        speed_m_s[falling] = acceleration * left_s[falling]
        # no deceleration at the end itself
        return length_m, speed_m_s, acceleration * (rising.astype(np.float64) - (falling & (left_s > 0.0)))


def trapezoid(distance_m: float, speed_m_s: float, acceleration_m_s2: float) -> Trapezoid:
    """Return the fastest trapezoid over `distance_m` (> 0) within speed and acceleration (> 0)."""
    speed_m_s = min(speed_m_s, math.sqrt(distance_m * acceleration_m_s2))
    ramp_s = speed_m_s / acceleration_m_s2
    return Trapezoid(distance_m, speed_m_s, ramp_s, max(distance_m / speed_m_s - ramp_s, 0.0))


class ThereAndBack(NamedTuple):
    """Parameters of the motion; `distance_m` may be negative, the others are positive."""

    label: str
    axis: int
    distance_m: float
    speed_m_s: float
    acceleration_m_s2: float
    repeats: int


def plan_there_and_back(step: ThereAndBack, start_m: Array) -> Profile:
    """Plan `repeats` moves there and back, which reverse at constant acceleration at both ends."""
    plan = trapezoid(abs(step.distance_m), step.speed_m_s, step.acceleration_m_s2)
    duration_s = 2.0 * step.repeats * plan.duration_s
    direction = math.copysign(1.0, step.distance_m)

    def at(time_s: Array) -> Motion:
        stroke = np.minimum(time_s // plan.duration_s, 2 * step.repeats - 1)
        into_s = np.clip(time_s - stroke * plan.duration_s, 0.0, plan.duration_s)
        length_m, speed_m_s, acceleration_m_s2 = plan.travelled(into_s)
        back = stroke % 2 == 1
        sense = direction * np.where(back, -1.0, 1.0)
        motion = resting(start_m, len(time_s))
        motion.position_m[:, step.axis] += direction * np.where(back, plan.distance_m - length_m, length_m)
        motion.velocity_m_s[:, step.axis] = sense * speed_m_s
        motion.acceleration_m_s2[:, step.axis] = sense * acceleration_m_s2
        motion.acceleration_m_s2[time_s >= duration_s] = 0.0
        return motion

    return Profile(duration_s, start_m, at)
