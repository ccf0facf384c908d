"""Five-phase S curve: positive jerk, negative jerk, cruise, mirrored (Wang et al. 2014, eq. 2-4, figure 6b).

There is no phase of constant acceleration: the acceleration is a triangle of height j tj, and a ramp of
duration 2 tj reaches v = j tj^2 over the distance v tj. A small acceleration limit or distance determines
tj, with a jerk below its limit:

    no cruise:  tj = max((d / 2j)^(1/3), (d / 2a)^(1/2)),  v = d / (2 tj)
    cruise:     tj = max((v / j)^(1/2), v / a),            t_cruise = d / v - 2 tj
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array


class SCurve(NamedTuple):
    """Path length over time; all SI, `jerk_s` > 0, `cruise_s` >= 0."""

    distance_m: float
    speed_m_s: float
    jerk_s: float
    """Duration tj of each of the four jerk phases."""
    cruise_s: float

    @property
    def duration_s(self) -> float:
        """Duration of the four jerk phases and the cruise."""
        return 4.0 * self.jerk_s + self.cruise_s

    def travelled(self, time_s: Array) -> tuple[Array, Array, Array]:
        """Return length m, speed m/s and acceleration m/s^2 at 0 <= t <= duration, each (n,)."""
        remaining_s = self.duration_s - time_s
        falling = remaining_s < time_s
        # the curve is symmetric, so each instant is computed from the nearer end
        length_m, speed_m_s, acceleration_m_s2 = self._risen(np.where(falling, remaining_s, time_s))
        length_m = np.where(falling, self.distance_m - length_m, length_m)
        return length_m, speed_m_s, np.where(falling, -acceleration_m_s2, acceleration_m_s2)

    def _risen(self, time_s: Array) -> tuple[Array, Array, Array]:
        """Evaluate the ramp from rest and the cruise after it."""
        tj, speed = self.jerk_s, self.speed_m_s
        jerk = speed / tj**2
        first = np.clip(time_s, 0.0, tj)
        second = np.clip(2.0 * tj - time_s, 0.0, tj)  # time left in the second jerk phase
        in_first = time_s < tj
        length_m = np.where(in_first, jerk * first**3 / 6.0, speed * (time_s - tj) + jerk * second**3 / 6.0)
        speed_m_s = np.where(in_first, 0.5 * jerk * first**2, speed - 0.5 * jerk * second**2)
        return length_m, speed_m_s, jerk * np.where(in_first, first, second)


def s_curve(distance_m: float, speed_m_s: float, acceleration_m_s2: float, jerk_m_s3: float) -> SCurve:
    """Return the fastest five-phase curve over `distance_m` (> 0) within the limits (> 0)."""
    jerk_s = max(math.cbrt(distance_m / (2.0 * jerk_m_s3)), math.sqrt(distance_m / (2.0 * acceleration_m_s2)))
    if distance_m / (2.0 * jerk_s) <= speed_m_s:
        return SCurve(distance_m, distance_m / (2.0 * jerk_s), jerk_s, 0.0)
    jerk_s = max(math.sqrt(speed_m_s / jerk_m_s3), speed_m_s / acceleration_m_s2)
    return SCurve(distance_m, speed_m_s, jerk_s, max(distance_m / speed_m_s - 2.0 * jerk_s, 0.0))
