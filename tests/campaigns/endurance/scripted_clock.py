"""Real time by a script instead of a timer: a tick as soon as the last one is done, late where it says so."""

import asyncio
from collections.abc import Callable
from types import MethodType

from servo_ctrl.daemon.cycle.cycle import Cycle
from servo_ctrl.io.clock import Lateness


class ScriptedClock:
    """Stands in for `TimerfdClock`. `elapsed(cycle)`: periods that go by before the tick after this cycle.

    The simulator is in lockstep, so that the run is the same each time; the plant does not move on in a gap.
    """

    def __init__(self, elapsed: Callable[[int], int], on_tick: MethodType) -> None:
        self.lateness = Lateness()
        self._elapsed, self._on_tick = elapsed, on_tick
        self._cycle: Cycle = on_tick.__self__
        self._loop: asyncio.AbstractEventLoop | None = None

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Tick from now on."""
        self._loop = loop
        loop.call_soon(self._turn)

    def close(self) -> None:
        """No further tick."""
        self._loop = None

    def _turn(self) -> None:
        if self._loop is None:
            return
        if not self._cycle.open:
            self.lateness.add(0)
            self._on_tick(self._elapsed(self._cycle.number))
        self._loop.call_later(1e-4, self._turn)
