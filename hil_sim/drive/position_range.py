"""Position range limit 607Bh: the positions of a rotary axis begin anew at one end of the range.

Inside the drive positions run on; what clients see (6062h, 6064h, touch probes) lies in the range, and a set
point of theirs stands for the place nearest, or in the direction of 60F2h, of those that look like it.
"""

import math

from hil_sim.cyclic import drive_step

WHOLE = (-(1 << 31), (1 << 31) - 1)
"""Default of 607Bh: every position there is, so that none wraps."""
DIRECTION = 0xC0
"""Rotary axis direction option, bits 6 and 7 of 60F2h."""
LINEAR, NEGATIVE, POSITIVE, SHORTEST = 0x00, 0x40, 0x80, 0xC0


class PositionRange:
    """`span` 0: no range, positions are as they are."""

    def __init__(self) -> None:
        self.take(*WHOLE)

    def take(self, low: int, high: int) -> None:
        """Take 607Bh:01 and 02."""
        self.low, self.high = low, high
        self.span = 0 if (low, high) == WHOLE else high - low + 1

    def shown(self, position: int) -> int:
        """A position as clients see it."""
        return drive_step.shown(self.low, self.span, position)

    def nearest(self, wanted: float, here: float) -> float:
        """The place that looks like `wanted` nearest to `here`; half a turn goes to the positive side."""
        return drive_step.nearest(self.span, float(wanted), float(here))

    def towards(self, wanted: int, here: float, direction: int) -> float:
        """The place that looks like `wanted`, gone to from `here` by the direction option of 60F2h.

        LINEAR goes as far as the two numbers differ, also beyond the end of the range: by turns.
        """
        if not self.span:
            return float(wanted)
        if direction == LINEAR:
            return here + wanted - (self.low + (here - self.low) % self.span)
        if direction == SHORTEST:
            return self.nearest(wanted, here)
        turns = (here - wanted) / self.span
        return wanted + self.span * (math.floor(turns) if direction == NEGATIVE else math.ceil(turns))
