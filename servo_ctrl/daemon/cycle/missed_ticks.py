"""Ticks that went by without a SYNC, as the computer was late: counted, and how many are too many."""

from servo_ctrl.axis.fault_bounds import GAP_TOLERATED_S

BLOCK_CYCLES = 1000
"""Misses are counted in blocks of so many periods."""


class BlockCount:
    """How many there were in the present block of cycles."""

    def __init__(self) -> None:
        self._block = self._count = 0

    def add(self, cycle: int, count: int) -> int:
        """So many more in this cycle; how many in its block."""
        if cycle // BLOCK_CYCLES != self._block:
            self._block, self._count = cycle // BLOCK_CYCLES, 0
        self._count += count
        return self._count

    def clear(self) -> None:
        """What was counted has been acted on."""
        self._count = 0


class MissedTicks:
    """`allowed`: misses in a block. The axes sail through a gap, on their last set points, if it is short."""

    def __init__(self, period_s: float, allowed: int) -> None:
        self.total = 0
        self._period_s, self._allowed = period_s, allowed
        self._in_block = BlockCount()

    def take(self, cycle: int, missed: int) -> str:
        """So many were missed before this cycle; why that is too much, "" while it is not."""
        self.total += missed
        in_block = self._in_block.add(cycle, missed)
        if missed * self._period_s > GAP_TOLERATED_S:
            return f"{missed} ticks were missed at one go: this computer is too busy"
        if in_block > self._allowed:
            self._in_block.clear()
            return f"more than {self._allowed} of {BLOCK_CYCLES} ticks were missed: this computer is too busy"
        return ""
