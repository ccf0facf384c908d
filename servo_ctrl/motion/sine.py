"""Sine of one axis about its position at the start: x = x0 + A sin(w t) (Feng et al. 2015, section 3).

Its reverse acceleration is a = A w^2.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.motion.profile import Motion, Profile, resting
from servo_ctrl.motion.smooth_turning import Turning, turned


class Sine(NamedTuple):
    """Parameters of the motion, all positive."""

    label: str
    axis: int
    amplitude_m: float
    speed_rad_s: float
    cycles: float
    ramp_s: float


def speed_for_reverse_acceleration(amplitude_m: float, acceleration_m_s2: float) -> float:
    """Return the angular speed, rad/s, that gives a sine of this amplitude this reverse acceleration."""
    return math.sqrt(acceleration_m_s2 / amplitude_m)


def turning_of(sine: Sine) -> Turning:
    """Return the angle of the sine over time."""
    return Turning(sine.speed_rad_s, sine.ramp_s, 2.0 * math.pi * sine.cycles)


def plan_sine(sine: Sine, start_m: Array) -> Profile:
    """Plan the sine about `start_m` (axes,)."""
    turning = turning_of(sine)

    def at(time_s: Array) -> Motion:
        angle, speed, acceleration = turned(turning, time_s)
        cos, sin = np.cos(angle), np.sin(angle)
        motion = resting(start_m, len(time_s))
        motion.position_m[:, sine.axis] += sine.amplitude_m * sin
        motion.velocity_m_s[:, sine.axis] = sine.amplitude_m * cos * speed
        motion.acceleration_m_s2[:, sine.axis] = sine.amplitude_m * (cos * acceleration - sin * speed**2)
        return motion

    end_m = at(np.array([turning.duration_s])).position_m[0]
    return Profile(turning.duration_s, end_m, at, turning.steady_s)
