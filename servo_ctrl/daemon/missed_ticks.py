"""Ticks that went by without a SYNC, as the computer was late: counted, and how many are too many."""

from __future__ import annotations

from servo_ctrl.axis.fault_bounds import GAP_TOLERATED_S

BLOCK_CYCLES = 1000
"""Misses are counted in blocks of so many periods."""


class MissedTicks:
    """`allowed`: misses in a block. The axes sail through a gap, on their last set points, if it is short."""

    def __init__(self, period_s: float, allowed: int) -> None:
        self.total = 0
        self._period_s, self._allowed = period_s, allowed
        self._block = self._in_block = 0

    def take(self, cycle: int, missed: int) -> str:
        """So many were missed before this cycle; why that is too much, "" while it is not."""
        self.total += missed
        if cycle // BLOCK_CYCLES != self._block:
            self._block, self._in_block = cycle // BLOCK_CYCLES, 0
        self._in_block += missed
        if missed * self._period_s > GAP_TOLERATED_S:
            return f"{missed} ticks were missed at one go: this computer is too busy"
        if self._in_block > self._allowed:
            self._in_block = 0
            return f"more than {self._allowed} of {BLOCK_CYCLES} ticks were missed: this computer is too busy"
        return ""
