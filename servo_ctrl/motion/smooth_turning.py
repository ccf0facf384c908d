"""An angle over time that starts and ends at rest, with constant angular speed in between.

The angular speed rises as w (3 s^2 - 2 s^3), s = t / Tr (chosen), so that angle, speed and acceleration
are continuous; each ramp covers w Tr / 2. Circle and sine use this angle.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array


class Turning(NamedTuple):
    """A turn from 0 to `total_rad` (> 0) at `speed_rad_s` (> 0), with ramps of `ramp_s` (> 0)."""

    speed_rad_s: float
    ramp_s: float
    total_rad: float

    @property
    def duration_s(self) -> float:
        """Time for the whole angle; the two ramps together add one ramp time."""
        return self.total_rad / self.speed_rad_s + self.ramp_s

    @property
    def steady_s(self) -> tuple[float, float]:
        """The span at constant speed."""
        return self.ramp_s, self.duration_s - self.ramp_s

    @property
    def fits(self) -> bool:
        """Whether the angle is large enough to reach the constant speed."""
        return self.speed_rad_s * self.ramp_s <= self.total_rad


def usual_ramp_s(speed_rad_s: float) -> float:
    """Return the time of a ramp over an eighth of a turn, whose peak acceleration 1.5 w / Tr is below w^2."""
    return math.pi / (2.0 * speed_rad_s)


def turned(turning: Turning, time_s: Array) -> tuple[Array, Array, Array]:
    """Return angle rad, speed rad/s and acceleration rad/s^2 at 0 <= t <= duration, each (n,)."""
    speed, ramp_s = turning.speed_rad_s, turning.ramp_s
    up = np.clip(time_s / ramp_s, 0.0, 1.0)
    down = np.clip((turning.duration_s - time_s) / ramp_s, 0.0, 1.0)
    falling = down < 1.0
    angle_rad = speed * (ramp_s * _area(up) + np.maximum(time_s - ramp_s, 0.0))
    angle_rad[falling] = turning.total_rad - speed * ramp_s * _area(down[falling])
    speed_rad_s = speed * np.where(falling, _smooth(down), _smooth(up))
    slope = np.where(falling, -_steep(down), _steep(up))
    return angle_rad, speed_rad_s, speed / ramp_s * slope


def _smooth(s: Array) -> Array:
    return s * s * (3.0 - 2.0 * s)


def _steep(s: Array) -> Array:
    """Return the derivative of `_smooth`."""
    return 6.0 * s * (1.0 - s)


def _area(s: Array) -> Array:
    """Return the integral of `_smooth` from 0."""
    return s * s * s * (1.0 - 0.5 * s)
