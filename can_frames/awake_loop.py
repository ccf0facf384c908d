"""Keeps an asyncio loop awake between the bursts of lockstep, while no other program wants the processor.

In lockstep the answer to a burst comes within some ten microseconds. A processor that goes to sleep in
between and is woken up needs longer for that alone, and calculates more slowly afterwards.
"""

import asyncio
import os
import time
from collections.abc import Callable, Collection
from pathlib import Path

AWAKE_S = 3e-4
"""How long an answer is awaited awake; several times what the slower side needs for one. Chosen."""
LOOK_S = 0.1
"""Interval of looking for other programs: it costs as much as a burst. Chosen."""
LOAD = Path("/proc/loadavg")


def is_running(pid: int) -> bool:
    """Whether the main thread of a process runs or wants to."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
    except OSError:
        return False
    return stat.rpartition(")")[2].split()[:1] == ["R"]


def running_programs() -> int | None:
    """Number of threads on this computer that run or want to, this one among them; None where unknown."""
    try:
        return int(LOAD.read_text(encoding="ascii").split()[3].partition("/")[0])
    except (OSError, ValueError, IndexError):
        return None


class AwakeLoop:
    """Call `on_burst` after each burst of frames; `look` reads the bus, and returns whether frames arrived.

    It stays awake where both sides of the bus have a processor: `peers` are the process ids of the other one,
    empty where the bus does not tell. Then a second program that runs may be the other side, or not; so
    it begins where a processor has nothing to do, and goes on while as many threads as processors run.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        look: Callable[[], bool],
        peers: Callable[[], Collection[int]],
        running: Callable[[], int | None] = running_programs,
        peer_runs: Callable[[int], bool] = is_running,
        now_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._loop, self._look, self._peers = loop, look, peers
        self._running, self._peer_runs, self._now_s = running, peer_runs, now_s
        self._processors = len(os.sched_getaffinity(0))
        self._permitted = self._turning = False
        self._until_s = self._looked_s = 0.0

    def on_burst(self) -> None:
        """Stay awake for the answer to this burst."""
        now_s = self._now_s()
        if now_s - self._looked_s > LOOK_S:
            self._looked_s = now_s
            self._permitted = self._both_have_a_processor()
        if self._permitted:
            self._until_s = now_s + AWAKE_S
            if not self._turning:
                self._turning = True
                self._loop.call_soon(self._turn)

    def _both_have_a_processor(self) -> bool:
        running, peers = self._running(), self._peers()
        if running is None or os.getpid() in peers:  # waiting here would keep the other side from answering
            return False
        asleep = not any(map(self._peer_runs, peers)) if peers else not self._permitted
        return running + asleep <= self._processors

    def _turn(self) -> None:
        """Look for the answer, again and again; once it has come, let the loop serve what else there is."""
        while self._now_s() < self._until_s:
            if self._look():
                self._loop.call_soon(self._turn)
                return
        self._turning = False
