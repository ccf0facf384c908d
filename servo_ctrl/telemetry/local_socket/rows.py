"""Keeps recorded rows for the page in a ring allocated in advance.

A tick packs one row, independent of the number and speed of clients; a slow client misses rows.
"""

import struct
from typing import NamedTuple

RING_ROWS = 8192
"""Rows in the ring; eight seconds at 1 kHz."""
BLOCK_ROWS_MAX = 2048
"""Bounds the rows of one message; chosen: 2 s at 1 kHz."""


class Packed(NamedTuple):
    """Rows packed for a message."""

    first: int
    rows: int
    values: bytes


class RowBuffer:
    """`end` is the number of the next row, counted from the start of the run."""

    def __init__(self, channels: int, capacity: int = RING_ROWS) -> None:
        self.end = 0
        self.capacity = capacity
        layout = struct.Struct(f"<{channels}d")
        self._size = layout.size
        self._pack_into = layout.pack_into
        self._rows = bytearray(capacity * layout.size)
        self._at = 0

    def take(self, values: list[float]) -> None:
        """Take the row of this cycle."""
        at = self._at
        self._pack_into(self._rows, at, *values)
        at += self._size
        self._at = at if at < len(self._rows) else 0
        self.end += 1

    def since(self, number: int) -> Packed:
        """Return at most `BLOCK_ROWS_MAX` rows from `number` on, without rows that the ring has lost."""
        first = max(number, self.end - self.capacity)
        rows = min(self.end - first, BLOCK_ROWS_MAX)
        start = first % self.capacity
        upper = min(rows, self.capacity - start)
        size = self._size
        values = bytes(self._rows[start * size : (start + upper) * size])
        if upper < rows:
            values += bytes(self._rows[: (rows - upper) * size])
        return Packed(first, rows, values)
