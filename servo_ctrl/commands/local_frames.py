"""Frames of the local socket: one byte kind, uint32 length, payload; see docs/local_socket.md.

A frame of kind "J" holds a JSON message, one of kind "R" recorded rows: float64, little-endian.
"""

import asyncio
import struct
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.errors import ServoCtrlError

FRAME = struct.Struct("<cI")
"""Kind and length of the payload."""
JSON, ROWS = b"J", b"R"
REQUEST_LIMIT = 1 << 18
"""Bounds the bytes of a client's frame, of which a part program is the longest; chosen. Reading this much
takes a fifth of a tick."""
MESSAGE_LIMIT = 1 << 24
"""Bounds the bytes of a server's frame; chosen."""
ROWS_HEAD = struct.Struct("<IQQ")
"""Number of rows, number of the first row, rows that this client has missed so far."""


class FrameError(ServoCtrlError):
    """The bytes are not a frame, so the start of the next frame is unknown."""


class RowBlock(NamedTuple):
    """Recorded rows, and how many rows this client has missed."""

    first: int
    """Number of the first row, counted from the start of the run."""
    missed: int
    """Rows that this client has missed so far."""
    values: Array
    """(rows, channels)."""


def frame(kind: bytes, payload: bytes) -> bytes:
    """Return the bytes of a frame."""
    return FRAME.pack(kind, len(payload)) + payload


async def read_frame(reader: asyncio.StreamReader, limit: int) -> tuple[bytes, bytes]:
    """Return kind and payload of the next frame. Raises FrameError; IncompleteReadError at the end."""
    kind, length = FRAME.unpack(await reader.readexactly(FRAME.size))
    if kind not in {JSON, ROWS}:
        raise FrameError(f"a frame of kind {kind!r}, neither J nor R")
    if length > limit:
        raise FrameError(f"a frame of {length} bytes, over {limit}")
    return kind, await reader.readexactly(length)


def rows_frame(first: int, missed: int, rows: int, values: bytes | memoryview) -> bytes:
    """Return a frame of rows; `values` are float64, little-endian, row by row."""
    head = FRAME.pack(ROWS, ROWS_HEAD.size + len(values))
    return b"".join((head, ROWS_HEAD.pack(rows, first, missed), values))


def row_block(payload: bytes, channels: int) -> RowBlock:
    """Return the rows in a payload. Raises FrameError."""
    if len(payload) < ROWS_HEAD.size:
        raise FrameError(f"rows in {len(payload)} bytes")
    rows, first, missed = ROWS_HEAD.unpack_from(payload)
    if len(payload) != ROWS_HEAD.size + rows * channels * 8:
        raise FrameError(f"{rows} rows of {channels} channels in {len(payload)} bytes")
    values = np.frombuffer(payload, "<f8", offset=ROWS_HEAD.size).reshape(rows, channels)
    return RowBlock(first, missed, values)
