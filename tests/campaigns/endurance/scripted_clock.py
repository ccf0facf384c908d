"""A real-time clock with a script instead of a timer: each tick follows the last one, late by the script."""

import asyncio
from collections.abc import Callable
from types import MethodType

from servo_ctrl.daemon.cycle.cycle import Cycle
from servo_ctrl.io.clock import Lateness


class ScriptedClock:
    """Replaces `TimerfdClock`. `elapsed(cycle)`: periods that pass before the tick after this cycle.

    The simulator is in lockstep, so that the run is reproducible; the plant does not advance in a gap.
    """

    def __init__(self, elapsed: Callable[[int], int], on_tick: MethodType) -> None:
        self.lateness = Lateness()
        self._elapsed, self._on_tick = elapsed, on_tick
        self._cycle: Cycle = on_tick.__self__
        self._loop: asyncio.AbstractEventLoop | None = None

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Start ticking."""
        self._loop = loop
        loop.call_soon(self._turn)

    def close(self) -> None:
        """Stop ticking."""
        self._loop = None

    def _turn(self) -> None:
        if self._loop is None:
            return
        if not self._cycle.open:
            self.lateness.add(0)
            self._on_tick(self._elapsed(self._cycle.number))
        self._loop.call_later(1e-4, self._turn)
