"""Jerk-limited ramps (6086h is 3): a moving average over linear ramps.

A moving average of length T over a velocity with accelerations up to `a` has a jerk of at most a / T, and of
2 a / T where acceleration changes to deceleration at once. It ends at the same position, T later.
"""

import math
from collections import deque


class JerkFilter:
    """Moving average of a demand; `settled`: all values in its window are equal."""

    def __init__(self, value: float, acceleration: float, jerk: float, dt_s: float) -> None:
        """Start at standstill at `value`, with the shortest window whose jerk stays within `jerk`.

        Units: counts, counts/s^2, counts/s^3.
        """
        length = max(1, math.ceil(2.0 * acceleration / (jerk * dt_s)))
        self._values = deque([value] * length, maxlen=length)
        self._sum = value * length
        self._last = value
        self._equal = length  # how many values of the window equal the last one

    @property
    def settled(self) -> bool:
        """Whether the demand is at standstill."""
        return self._equal >= len(self._values)

    def step(self, value: float) -> float:
        """Filter the value of the next tick; return the average, exactly the value once settled."""
        self._sum += value - self._values[0]
        self._values.append(value)
        self._equal = self._equal + 1 if value == self._last else 1
        self._last = value
        if self.settled:
            self._sum = value * len(self._values)
            return value
        return self._sum / len(self._values)
