"""Watches a TPDO that comes at a change, by its event timer (180xh:05), in SYNC cycles."""

from typing import Protocol

from servo_ctrl.canopen.node_plan import PdoPlan

TIMES_MISSED = 3
"""A TPDO is missing when so many of its times have gone by without it; chosen, as of heartbeats."""


class Counted(Protocol):
    """What counts the cycles."""

    number: int


class EventTimer:
    """Of the PDO called `name`; one without an event timer may be silent for ever."""

    def __init__(self, name: str, pdo: PdoPlan, period_s: float, cycle: Counted) -> None:
        self._name, self._cycle = name, cycle
        cycles = max(round(pdo.event_timer_ms * 1e-3 / period_s), 1)
        self._limit = TIMES_MISSED * cycles if pdo.event_timer_ms else 0
        self._last = 0
        self._missing = False

    def came(self) -> None:
        """Note that it came."""
        self._last, self._missing = self._cycle.number, False

    def advance(self, cycle: int) -> str:
        """Say once that it does not come any more; else ""."""
        silent = cycle - self._last
        if not self._limit or silent <= self._limit or self._missing:
            return ""
        self._missing = True
        return f"{self._name}: has not come for {silent} cycles, its event timer says otherwise"
