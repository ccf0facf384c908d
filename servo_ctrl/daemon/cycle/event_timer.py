"""Monitors an event-driven TPDO by its event timer (180xh:05), in SYNC cycles."""

from typing import Protocol

from servo_ctrl.canopen.node_plan import PdoPlan

TIMES_MISSED = 3
"""A TPDO is missing after this many event times without it; chosen, the same as for heartbeats."""


class Counted(Protocol):
    """Counts the cycles."""

    number: int


class EventTimer:
    """Monitors the PDO called `name`; a PDO without an event timer may be silent for any time."""

    def __init__(self, name: str, pdo: PdoPlan, period_s: float, cycle: Counted) -> None:
        self._name, self._cycle = name, cycle
        cycles = max(round(pdo.event_timer_ms * 1e-3 / period_s), 1)
        self._limit = TIMES_MISSED * cycles if pdo.event_timer_ms else 0
        self._last = 0
        self._missing = False

    def received(self) -> None:
        """Note that the TPDO was received."""
        self._last, self._missing = self._cycle.number, False

    def advance(self, cycle: int) -> str:
        """Return once that the TPDO no longer arrives; else ""."""
        silent = cycle - self._last
        if not self._limit or silent <= self._limit or self._missing:
            return ""
        self._missing = True
        return f"{self._name}: not received for {silent} cycles, longer than its event timer"
