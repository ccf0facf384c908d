"""Circle in the plane of two axes: x = R cos(w t), y = R sin(w t) (Feng et al. 2015).

The motion starts at the present position, which is centre + (R, 0). At the feed F the angular speed is
w = F / R and the reverse acceleration of each axis a = w^2 R = F^2 / R.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.motion.profile import Motion, Profile, resting
from servo_ctrl.motion.smooth_turning import Turning, turned


class Circle(NamedTuple):
    """Parameters of the motion, all positive; `turns` need not be whole."""

    label: str
    axes: tuple[int, int]
    """Indices of the two axes of the plane; the first one starts at +R."""
    radius_m: float
    feed_m_s: float
    turns: float
    counterclockwise: bool
    ramp_s: float


def turning_of(circle: Circle) -> Turning:
    """Return the angle of the circle over time."""
    return Turning(circle.feed_m_s / circle.radius_m, circle.ramp_s, 2.0 * math.pi * circle.turns)


def plan_circle(circle: Circle, start_m: Array) -> Profile:
    """Plan the circle from `start_m` (axes,)."""
    turning = turning_of(circle)
    sense = 1.0 if circle.counterclockwise else -1.0
    first, second = circle.axes
    radius_m = circle.radius_m

    def at(time_s: Array) -> Motion:
        angle, speed, acceleration = turned(turning, time_s)
        cos, sin = np.cos(angle), np.sin(angle)
        motion = resting(start_m, len(time_s))
        motion.position_m[:, first] += radius_m * (cos - 1.0)
        motion.position_m[:, second] += radius_m * sense * sin
        motion.velocity_m_s[:, first] = -radius_m * sin * speed
        motion.velocity_m_s[:, second] = radius_m * sense * cos * speed
        motion.acceleration_m_s2[:, first] = -radius_m * (cos * speed**2 + sin * acceleration)
        motion.acceleration_m_s2[:, second] = radius_m * sense * (cos * acceleration - sin * speed**2)
        return motion

    end_m = at(np.array([turning.duration_s])).position_m[0]
    return Profile(turning.duration_s, end_m, at, turning.steady_s)
