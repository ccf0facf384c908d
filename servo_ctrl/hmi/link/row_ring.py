"""A ring buffer of the newest rows of the recording, all channels of the last minute.

Rows are numbered as they arrive, and the numbers never go back, not even when the connection is lost and made
again. Where rows were missed, the channel `cycle` jumps and the row number does not.
"""

import math
from collections.abc import Sequence

import numpy as np

from kernels.arrays import Array


class RowRing:
    """The newest `capacity` rows of the channels `names`; every array that is returned is a copy."""

    def __init__(self, names: Sequence[str], capacity: int, first: int = 0) -> None:
        self.names = tuple(names)
        self.capacity = capacity
        self.end = first
        """Number of the next row to arrive."""
        self._places = {name: place for place, name in enumerate(self.names)}
        # twice the capacity keeps the newest rows contiguous: they move to the front once a capacity
        self._rows = np.empty((2 * capacity, len(self.names)))
        self._stop = self._count = 0

    @property
    def first(self) -> int:
        """Number of the oldest row in the buffer."""
        return self.end - self._count

    def __len__(self) -> int:
        return self._count

    def extend(self, values: Array) -> None:
        """Append rows (n, channels)."""
        self.end += len(values)
        values = values[-self.capacity :]
        if self._stop + len(values) > len(self._rows):
            kept = min(self._count, self.capacity - len(values))
            self._rows[:kept] = self._rows[self._stop - kept : self._stop]
            self._stop = kept
        self._rows[self._stop : self._stop + len(values)] = values
        self._stop += len(values)
        self._count = min(self._count + len(values), self.capacity)

    def since(self, number: int) -> tuple[int, Array]:
        """Return the rows (n, channels) from `number` on that are kept, and the number of the first."""
        first = min(max(number, self.first), self.end)
        return first, self._rows[self._stop - (self.end - first) : self._stop].copy()

    def column(self, name: str, since: int = 0) -> Array:
        """Return one channel (n,) from row `since` on. Raises KeyError."""
        place = self.place(name)
        count = self.end - min(max(since, self.first), self.end)
        return self._rows[self._stop - count : self._stop, place].copy()

    def newest(self, name: str) -> float:
        """Return the newest value of a channel; NaN without a row or such a channel."""
        place = self._places.get(name)
        return math.nan if place is None or not self._count else float(self._rows[self._stop - 1, place])

    def place(self, name: str) -> int:
        """Return the column of a channel in a row. Raises KeyError."""
        return self._places[name]
