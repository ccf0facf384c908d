"""Counts ticks that had no SYNC because the computer was late, and says when they are too many."""

from servo_ctrl.axis.fault_bounds import GAP_TOLERATED_S

BLOCK_CYCLES = 1000
"""Length of the blocks in which misses are counted, in periods: the unit of `bus.missed_per_1000`."""


class BlockCount:
    """Counts within the present block of cycles."""

    def __init__(self) -> None:
        self._block = self._count = 0

    def add(self, cycle: int, count: int) -> int:
        """Add `count` in this cycle; return the count of its block."""
        if cycle // BLOCK_CYCLES != self._block:
            self._block, self._count = cycle // BLOCK_CYCLES, 0
        self._count += count
        return self._count

    def clear(self) -> None:
        """Start again from zero after the machine has reacted."""
        self._count = 0


class MissedTicks:
    """Tolerates `allowed` misses in a block, and short gaps, in which the axes keep their set points."""

    def __init__(self, period_s: float, allowed: int) -> None:
        self.total = 0
        self._period_s, self._allowed = period_s, allowed
        self._in_block = BlockCount()

    def count(self, cycle: int, missed: int) -> str:
        """Count the ticks missed before this cycle; return why they are too many, else ""."""
        self.total += missed
        in_block = self._in_block.add(cycle, missed)
        if missed * self._period_s > GAP_TOLERATED_S:
            return f"{missed} consecutive ticks were missed: this computer is too busy"
        if in_block > self._allowed:
            self._in_block.clear()
            return f"more than {self._allowed} of {BLOCK_CYCLES} ticks were missed: this computer is too busy"
        return ""
