"""Jerk-limited ramps (6086h is 3): a moving average over the linear ones.

The average of a velocity that changes at up to `a` over a window of T changes its acceleration at up to a / T
(twice that where acceleration turns into deceleration at once), and comes to the same end, T later.
"""

import math
from collections import deque


class JerkFilter:
    """Average of the last values of a demand; `settled`: all of them are equal."""

    def __init__(self, value: float, acceleration: float, jerk: float, dt_s: float) -> None:
        """Begin at rest at `value`; within `jerk` an acceleration turns over in the window."""
        length = max(1, math.ceil(2.0 * acceleration / (jerk * dt_s)))
        self._values = deque([value] * length, maxlen=length)
        self._sum = value * length
        self._last = value
        self._equal = length  # values in the window that are the last one

    @property
    def settled(self) -> bool:
        """Whether the demand has come to rest."""
        return self._equal >= len(self._values)

    def step(self, value: float) -> float:
        """Take the next value, one tick later; return the average, exactly the value once it rests."""
        self._sum += value - self._values[0]
        self._values.append(value)
        self._equal = self._equal + 1 if value == self._last else 1
        self._last = value
        if self.settled:
            self._sum = value * len(self._values)
            return value
        return self._sum / len(self._values)
