"""What happened in a run, in words: bounded however long it lasts, and never deaf.

The first events are kept, for the cause of a trouble is among them, and the newest. What says the same again
and again, cycle after cycle, is one event; when it comes back after a while, it is another one.
"""

from collections import deque

FIRST_KEPT = 50
NEWEST_KEPT = 50
TOLD = 100


class EventLog:
    """`again_cycles`: a text that was silent for so many cycles is news."""

    def __init__(self, again_cycles: int) -> None:
        self.count = 0
        """Events so far, those that are not kept too."""
        self.newest: deque[tuple[int, str]] = deque(maxlen=TOLD)
        """Cycle and text, for whoever looks on."""
        self._again_cycles = again_cycles
        self._first: list[str] = []
        self._newest: deque[str] = deque(maxlen=NEWEST_KEPT)
        self._said: dict[str, int] = {}
        """Cycle in which a text of `_first` or `_newest` was said last."""

    @property
    def kept(self) -> list[str]:
        """The first and the newest, in order."""
        return [*self._first, *self._newest]

    def add(self, text: str, cycle: int) -> None:
        """Something has happened in this cycle."""
        said = self._said.get(text)
        self._said[text] = cycle
        if said is not None and cycle - said < self._again_cycles:
            return
        self.count += 1
        self.newest.append((cycle, text))
        if len(self._first) < FIRST_KEPT:
            self._first.append(text)
            return
        if len(self._newest) == NEWEST_KEPT:
            oldest = self._newest.popleft()
            if oldest not in self._newest and oldest not in self._first and oldest != text:
                del self._said[oldest]
        self._newest.append(text)
