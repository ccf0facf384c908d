"""A CAN frame as 16 bytes: `struct can_frame` of `linux/can.h`. A burst is a sequence of frames."""

import struct

FRAME_BYTES = 16
FRAME = struct.Struct("=IB3x8s")
"""Identifier with flags, data length, data."""
HEADER = struct.Struct("=IB")
DATA_AT = 8
"""Offset of the data, bytes."""
EXTENDED = 0x8000_0000
REMOTE = 0x4000_0000
ERROR = 0x2000_0000
IDENTIFIER_MASK = 0x1FFF_FFFF
LARGEST_STANDARD = 0x7FF
"""A header up to this value has no flag set: it belongs to a data frame with an 11-bit identifier."""


FRAME_BITS = tuple(47 + 8 * size + (34 + 8 * size - 1) // 4 for size in range(9))
"""Bits of a standard data frame on the wire by its data bytes, with the most possible stuff bits."""


def pack_frame(can_id: int, payload: bytes) -> bytes:
    """Pack a standard data frame."""
    return FRAME.pack(can_id, len(payload), payload)


CONTROLLER_PROBLEM, RECEIVE_OVERFLOW = 0x004, 0x01
"""Class of an error frame, and the bit of its data byte 1 (`linux/can/error.h`)."""
_MOST_LOST = 0xFF_FFFF


def overrun_frame(lost_frames: int) -> bytes:
    """Pack the error frame that reports how many frames a client lost by reading too late.

    The last three data bytes, which `linux/can/error.h` leaves to the controller, hold the number, at most
    2^24 - 1.
    """
    number = min(lost_frames, _MOST_LOST).to_bytes(3, "big")
    return FRAME.pack(ERROR | CONTROLLER_PROBLEM, 8, bytes((0, RECEIVE_OVERFLOW, 0, 0, 0)) + number)
