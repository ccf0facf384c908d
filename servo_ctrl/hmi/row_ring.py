"""The newest rows of the recording, as the page keeps them: all channels of the last minute.

Rows are numbered as they arrive, and the numbers never go back: who asks for what is new since a number gets
it, whatever happened to the connection meanwhile. Where rows were missed, the channel `cycle` jumps.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]


class RowRing:
    """`capacity` rows of the channels `names`. What it gives out are copies."""

    def __init__(self, names: Sequence[str], capacity: int, first: int = 0) -> None:
        self.names = tuple(names)
        self.capacity = capacity
        self.missed = 0
        """Rows that did not arrive, as the server counts them."""
        self.end = first
        """Number of the next row."""
        self._places = {name: place for place, name in enumerate(self.names)}
        # Twice the room, so that the newest rows always lie together: they move to the front once a capacity.
        self._rows = np.empty((2 * capacity, len(self.names)))
        self._stop = self._count = 0

    @property
    def first(self) -> int:
        """Number of the oldest row that is still there."""
        return self.end - self._count

    def __len__(self) -> int:
        return self._count

    def extend(self, values: Array) -> None:
        """Rows (n, channels) have arrived."""
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
        """The rows from this number on, (n, channels), and the number of the first; older ones are gone."""
        first = min(max(number, self.first), self.end)
        return first, self._rows[self._stop - (self.end - first) : self._stop].copy()

    def column(self, name: str, since: int = 0) -> Array:
        """One channel, (n,), from this number on. Raises KeyError."""
        place = self.place(name)
        count = self.end - min(max(since, self.first), self.end)
        return self._rows[self._stop - count : self._stop, place].copy()

    def place(self, name: str) -> int:
        """Where a channel is in a row. Raises KeyError."""
        return self._places[name]
