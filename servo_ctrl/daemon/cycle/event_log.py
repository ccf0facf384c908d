"""The texts of a run's events, in bounded memory however long the run lasts.

The log keeps the first events, which usually contain the cause, and the newest. A text that repeats cycle
after cycle is one event; after a pause it is a new event.
"""

from collections import deque

FIRST_KEPT = 50
NEWEST_KEPT = 50
"""Bound the events kept for report and recording, the first and the newest; chosen."""
PUBLISHED = 100
"""Bounds the events in the status of the page; chosen."""


class EventLog:
    """A text is a new event if it was not added during the last `again_cycles` cycles."""

    def __init__(self, again_cycles: int) -> None:
        self.count = 0
        """Events so far, including those no longer kept."""
        self.newest: deque[tuple[int, str]] = deque(maxlen=PUBLISHED)
        """Cycle and text of each event that the page shows."""
        self._again_cycles = again_cycles
        self._first: list[str] = []
        self._newest: deque[str] = deque(maxlen=NEWEST_KEPT)
        self._first_cycles: list[int] = []
        self._newest_cycles: deque[int] = deque(maxlen=NEWEST_KEPT)
        self._last_cycle: dict[str, int] = {}
        """By text in `_first` and `_newest`: the cycle in which it was last added."""

    @property
    def kept(self) -> list[str]:
        """The first and the newest events, in order."""
        return [*self._first, *self._newest]

    @property
    def kept_cycles(self) -> list[int]:
        """The cycles of those."""
        return [*self._first_cycles, *self._newest_cycles]

    def add(self, text: str, cycle: int) -> None:
        """Add the text of an event of this cycle."""
        last_cycle = self._last_cycle.get(text)
        self._last_cycle[text] = cycle
        if last_cycle is not None and cycle - last_cycle < self._again_cycles:
            return
        self.count += 1
        self.newest.append((cycle, text))
        if len(self._first) < FIRST_KEPT:
            self._first.append(text)
            self._first_cycles.append(cycle)
            return
        if len(self._newest) == NEWEST_KEPT:
            oldest = self._newest.popleft()
            if oldest not in self._newest and oldest not in self._first and oldest != text:
                del self._last_cycle[oldest]
        self._newest.append(text)
        self._newest_cycles.append(cycle)
