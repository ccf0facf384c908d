"""The binary stream of the rows: minimum and maximum of each channel, so that no peak is lost.

A tick only copies its row into preallocated memory; the pairs are computed later, when a message is sent.
Messages that the broker accepts too slowly are dropped, the oldest first, and counted. docs/mqtt.md describes
the layout; `HEADER` and `PAIR` are all of it except the values.
"""

import asyncio
import json
import struct
import time
from collections import deque
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from servo_ctrl.recording.channels import channels_of, places_of

MAGIC = b"SCR1"
"""Servo controller's rows, layout 1."""
HEADER = struct.Struct("<4sIIqHH")
"""MAGIC, sequence, dropped, time (us since 1970, UTC), pairs, channels."""
PAIR = struct.Struct("<QII")
"""First cycle, cycles from first to last, rows; then minimum and maximum of each channel, float32."""
MESSAGE_S = 0.1
"""Time covered by the rows of a message, unless it would be too large."""
LARGEST_MESSAGE = 32_768
"""Bounds the bytes of a message; chosen."""
WAITING = 32
"""Bounds the messages that wait for the broker; chosen: three seconds."""
FORMAT = 1
_MODULUS = 1 << 32


class _Block(NamedTuple):
    """The rows of one message, with its sequence number and time."""

    memory: bytearray
    rows: int
    sequence: int
    time_us: int


class RowStream:
    """Each tick calls `take`; the sender calls `next_message` in the same thread."""

    def __init__(self, axis_names: Sequence[str], period_s: float, stream_hz: float) -> None:
        channels = channels_of(axis_names)
        places = places_of(axis_names)
        self._cycle, self._first = places["cycle"], places["segment"]
        """The columns before the segment, time and cycle, are in each pair's header."""
        self._channels = channels[self._first :]
        self._period_s = period_s
        self.rows_a_pair = max(round(1.0 / (period_s * stream_hz)), 1)
        fitting = (LARGEST_MESSAGE - HEADER.size) // (PAIR.size + 8 * len(self._channels))
        wanted = max(round(MESSAGE_S / (self.rows_a_pair * period_s)), 1)
        self.dropped = 0
        """Messages dropped before they were sent."""
        self._sequence = 0
        self._layout = struct.Struct(f"<{len(channels)}d")
        size = min(wanted, max(fitting, 1)) * self.rows_a_pair * self._layout.size
        self._free = deque(bytearray(size) for _ in range(WAITING + 1))
        self._full: deque[_Block] = deque()
        self._memory, self._at, self._end = self._free.popleft(), 0, size
        self._noted = asyncio.Event()

    def take(self, values: list[float]) -> None:
        """Take the row of this cycle."""
        self._layout.pack_into(self._memory, self._at, *values)
        self._at += self._layout.size
        if self._at == self._end:
            self._next_block()

    async def next_message(self) -> bytes:
        """Return the oldest waiting message, or wait for the next one."""
        while not self._full:
            self._noted.clear()
            await self._noted.wait()
        block = self._full.popleft()
        message = self._message(block)
        self._free.append(block.memory)
        return message

    def rest(self) -> bytes:
        """Return the remaining rows as a shorter message; empty without rows."""
        if not self._at:
            return b""
        message = self._message(self._sealed())
        self._at = 0
        return message

    def discard(self) -> None:
        """Drop the waiting messages, which are too old for new subscribers."""
        while self._full:
            self._drop()

    def description(self) -> bytes:
        """Describe the channels of the stream, for its retained topic."""
        content: dict[str, Any] = {
            "format": FORMAT,
            "period_s": self._period_s,
            "rows_a_pair": self.rows_a_pair,
            "channels": [{"name": channel.name, "unit": channel.unit} for channel in self._channels],
        }
        return json.dumps(content, separators=(",", ":")).encode("ascii")

    def _next_block(self) -> None:
        self._full.append(self._sealed())
        if not self._free:
            self._drop()
        self._memory, self._at = self._free.popleft(), 0
        self._noted.set()

    def _drop(self) -> None:
        self._free.append(self._full.popleft().memory)
        self.dropped += 1

    def _sealed(self) -> _Block:
        rows = self._at // self._layout.size
        block = _Block(self._memory, rows, self._sequence, time.time_ns() // 1000)
        self._sequence = (self._sequence + 1) % _MODULUS
        return block

    def _message(self, block: _Block) -> bytes:
        channels = len(self._channels)
        values = np.frombuffer(block.memory, dtype="<f8", count=block.rows * (self._first + channels))
        rows = values.reshape(block.rows, -1)
        starts = list(range(0, block.rows, self.rows_a_pair))
        both = np.empty((len(starts), channels, 2), dtype="<f4")
        # fmin and fmax ignore NaN, unless all values are NaN
        both[:, :, 0] = np.fmin.reduceat(rows[:, self._first :], starts, axis=0)
        both[:, :, 1] = np.fmax.reduceat(rows[:, self._first :], starts, axis=0)
        cycles = rows[:, self._cycle].tolist()
        dropped = self.dropped % _MODULUS
        parts = [HEADER.pack(MAGIC, block.sequence, dropped, block.time_us, len(starts), channels)]
        for pair, start in zip(both, starts, strict=True):
            end = min(start + self.rows_a_pair, block.rows)
            first = int(cycles[start])
            parts += [PAIR.pack(first, int(cycles[end - 1]) - first + 1, end - start), pair.tobytes()]
        return b"".join(parts)
