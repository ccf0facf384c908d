"""A CAN frame as 16 bytes: `struct can_frame` of `linux/can.h`. A burst is frames one behind the other."""

import struct

FRAME_BYTES = 16
FRAME = struct.Struct("=IB3x8s")
"""Identifier with its flags, data length, data."""
HEADER = struct.Struct("=IB")
DATA_AT = 8
"""Where the data begin."""
EXTENDED = 0x8000_0000
REMOTE = 0x4000_0000
ERROR = 0x2000_0000
IDENTIFIER_MASK = 0x1FFF_FFFF
LARGEST_STANDARD = 0x7FF
"""A header up to here is a data frame's with an identifier of 11 bits: no flag is set."""


FRAME_BITS = tuple(47 + 8 * size + (34 + 8 * size - 1) // 4 for size in range(9))
"""Bits of a standard data frame on the wire by its bytes, with as many stuff bits as it may have."""


def pack_frame(can_id: int, payload: bytes) -> bytes:
    """Pack a standard data frame."""
    return FRAME.pack(can_id, len(payload), payload)
