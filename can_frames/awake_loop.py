"""Keeps an asyncio loop awake between the bursts of lockstep, while no other program wants the processor.

In lockstep the answer to a burst comes within some ten microseconds. A processor that goes to sleep in
between and is woken up needs longer for that alone, and calculates more slowly afterwards.
"""

import asyncio
import os
import time
from collections.abc import Callable
from pathlib import Path

AWAKE_S = 3e-4
"""How long an answer is awaited awake; several times what the slower side needs for one. Chosen."""
LOOK_S = 0.1
"""Interval of looking for other programs: it costs as much as a burst. Chosen."""
LOAD = Path("/proc/loadavg")


def running_programs() -> int | None:
    """Number of threads on this computer that run or want to, this one among them; None where unknown."""
    try:
        return int(LOAD.read_text(encoding="ascii").split()[3].partition("/")[0])
    except (OSError, ValueError, IndexError):
        return None


class AwakeLoop:
    """Call `on_burst` after each burst of frames; `look` reads the bus, and returns whether frames had come.

    It begins where a processor has nothing to do, and goes on while as many threads as processors run: the
    other side of the bus stays awake too.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        look: Callable[[], bool],
        running: Callable[[], int | None] = running_programs,
        now_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._loop, self._look, self._running, self._now_s = loop, look, running, now_s
        self._processors = len(os.sched_getaffinity(0))
        self._permitted = self._turning = False
        self._until_s = self._looked_s = 0.0

    def on_burst(self) -> None:
        """Stay awake for the answer to this burst."""
        now_s = self._now_s()
        if now_s - self._looked_s > LOOK_S:
            self._looked_s = now_s
            running = self._running()
            most = self._processors if self._permitted else self._processors - 1
            self._permitted = running is not None and running <= most
        if self._permitted:
            self._until_s = now_s + AWAKE_S
            if not self._turning:
                self._turning = True
                self._loop.call_soon(self._turn)

    def _turn(self) -> None:
        """Look for the answer, again and again; once it has come, let the loop serve what else there is."""
        while self._now_s() < self._until_s:
            if self._look():
                self._loop.call_soon(self._turn)
                return
        self._turning = False
