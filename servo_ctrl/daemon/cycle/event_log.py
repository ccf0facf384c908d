"""What happened in a run, in words: bounded however long it lasts, and never deaf.

The first events are kept, for the cause of a trouble is among them, and the newest. A text that repeats cycle
after cycle is one event; when it comes back after a while, it is another one.
"""

from collections import deque

FIRST_KEPT = 50
NEWEST_KEPT = 50
PUBLISHED = 100
"""Events in the status of the page. Chosen, as the numbers above."""


class EventLog:
    """A text that did not come for `again_cycles` cycles is news."""

    def __init__(self, again_cycles: int) -> None:
        self.count = 0
        """Events so far, those that are not kept too."""
        self.newest: deque[tuple[int, str]] = deque(maxlen=PUBLISHED)
        """Cycle and text, for the page."""
        self._again_cycles = again_cycles
        self._first: list[str] = []
        self._newest: deque[str] = deque(maxlen=NEWEST_KEPT)
        self._last_cycle: dict[str, int] = {}
        """Of the texts in `_first` and `_newest`: the cycle in which they came last."""

    @property
    def kept(self) -> list[str]:
        """The first and the newest, in order."""
        return [*self._first, *self._newest]

    def add(self, text: str, cycle: int) -> None:
        """Note what has happened in this cycle."""
        last_cycle = self._last_cycle.get(text)
        self._last_cycle[text] = cycle
        if last_cycle is not None and cycle - last_cycle < self._again_cycles:
            return
        self.count += 1
        self.newest.append((cycle, text))
        if len(self._first) < FIRST_KEPT:
            self._first.append(text)
            return
        if len(self._newest) == NEWEST_KEPT:
            oldest = self._newest.popleft()
            if oldest not in self._newest and oldest not in self._first and oldest != text:
                del self._last_cycle[oldest]
        self._newest.append(text)
