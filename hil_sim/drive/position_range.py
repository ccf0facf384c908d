"""Position range limit 607Bh: the positions of a rotary axis wrap at the ends of the range.

Positions inside the drive do not wrap; those in process objects (6062h, 6064h, touch probes) do. A set point
is therefore equivalent to one position in each turn: the drive moves to the nearest, or to the next one in
the direction of 60F2h.
"""

import math

from hil_sim.cyclic import drive_readings, drive_step

WHOLE = (-(1 << 31), (1 << 31) - 1)
"""Default of 607Bh: the whole range of the object's type, so that no position wraps."""
DIRECTION = 0xC0
"""Rotary axis direction option, bits 6 and 7 of 60F2h."""
LINEAR, NEGATIVE, POSITIVE, SHORTEST = 0x00, 0x40, 0x80, 0xC0


class PositionRange:
    """The range of one axis; `span` (counts) is 0 where positions do not wrap."""

    def __init__(self) -> None:
        self.set_limits(*WHOLE)

    def set_limits(self, low: int, high: int) -> None:
        """Apply 607Bh:01 and 02 (counts)."""
        self.low, self.high = low, high
        self.span = 0 if (low, high) == WHOLE else high - low + 1

    def wrapped(self, position: int) -> int:
        """Return a position (counts) as process objects show it: within the range."""
        return drive_readings.wrapped(self.low, self.span, position)

    def nearest_equivalent(self, set_point: float, here: float) -> float:
        """Return the equivalent of `set_point` nearest to the position `here`; of two, the positive one."""
        return drive_step.nearest_equivalent(self.span, float(set_point), float(here))

    def towards(self, set_point: int, here: float, direction: int) -> float:
        """Return the equivalent of `set_point` that lies from `here` in the direction of 60F2h.

        LINEAR travels the difference of the two wrapped positions, also beyond an end of the range.
        """
        if not self.span:
            return float(set_point)
        if direction == LINEAR:
            return here + set_point - (self.low + (here - self.low) % self.span)
        if direction == SHORTEST:
            return self.nearest_equivalent(set_point, here)
        turns = (here - set_point) / self.span
        return set_point + self.span * (math.floor(turns) if direction == NEGATIVE else math.ceil(turns))
