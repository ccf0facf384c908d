"""The wire format: the 16-byte SocketCAN frame, its rank, its length in bits, filters and bursts.

The layouts are `struct can_frame` and `struct can_filter` of Linux's `linux/can.h`. ISO 11898-1 defines the
bits of a frame.
"""

import struct

from can_frames.frame import CONTROLLER_PROBLEM, RECEIVE_OVERFLOW

Filters = tuple[tuple[int, int], ...]
"""Identifier and mask of each filter, including the flags of the frame."""

FRAME_BYTES = 16
# Identifier and flags, data length, mark, two reserved bytes, eight data bytes.
FRAME = struct.Struct("=IBB2x8s")
HEADER = struct.Struct("=IBB")

EXTENDED = 0x8000_0000
REMOTE = 0x4000_0000
ERROR = 0x2000_0000
STANDARD_ID_MASK = 0x7FF
EXTENDED_ID_MASK = 0x1FFF_FFFF

MARK_OWN = 1
"""Mark (a padding byte in SocketCAN) of a frame that returns to its sender."""

ATTACH = b"a"
"""Packet of a client: attach me to the bus."""
ATTACH_WITH_OWN = b"o"
"""Packet of a client: attach me, and also send me my own frames after they were on the bus."""
ATTACHED = b"!"
"""Answer of the hub: from now on you receive every frame that passes your filters."""
BURSTS = b"b"
"""Packet of a client: from now on send me several frames in one packet. Any client may send bursts."""
MOST_FRAMES = 64
"""Bounds the frames of a packet (chosen)."""
MOST_BYTES = MOST_FRAMES * FRAME_BYTES
FILTERS = b"f"
"""Start of a client's packet of filters, which replace its earlier ones; before `ATTACH` or later."""
FILTER = struct.Struct("=II")
MOST_FILTERS = 512
"""Bounds a packet of filters: CAN_RAW_FILTER_MAX of `linux/can/raw.h`."""
FILTERS_BYTES = len(FILTERS) + MOST_FILTERS * FILTER.size
PASS_ALL: Filters = ((0, 0),)

_HEADERS = tuple(struct.Struct("=" + count * "I12x") for count in range(MOST_FRAMES + 1))
"""By the number of frames in a packet: the layout that reads their headers."""
_CRC_POLYNOMIAL = 0x4599
_ERROR_BITS = 17  # error flag 6, error delimiter 8, interframe space 3
_UNSTUFFED_BITS = 13  # CRC delimiter 1, acknowledgement 2, end of frame 7, interframe space 3


def arbitration_rank(frame: bytes) -> int:
    """Return the arbitration field of `frame` as a number; the lowest wins, because 0 is dominant.

    A standard frame beats the extended one with the same first eleven bits, and a data frame beats the
    remote frame with the same identifier. An error frame destroys any other frame, so it comes first.
    """
    header: int = HEADER.unpack_from(frame)[0]
    if header & ERROR:
        return -1
    remote = 1 if header & REMOTE else 0
    if header & EXTENDED:
        identifier = header & EXTENDED_ID_MASK
        return (identifier >> 18) << 21 | 0b11 << 19 | (identifier & 0x3_FFFF) << 1 | remote
    return (header & STANDARD_ID_MASK) << 21 | remote << 20


def frame_bits(frame: bytes) -> int:
    """Return the bits of `frame` on the wire, including interframe space and stuff bits.

    Without stuff bits this is 47 + 8 n for a standard frame of n data bytes and 67 + 8 n for an extended
    one. An error frame is an error flag and its delimiter.
    """
    header, length, _, data = FRAME.unpack(frame)
    if header & ERROR:
        return _ERROR_BITS
    rank = arbitration_rank(frame)
    remote = bool(header & REMOTE)
    if header & EXTENDED:
        bits, count = rank << 2, 1 + 32 + 2  # start of frame, arbitration field, two reserved bits
    else:
        bits, count = rank >> 20 << 2, 1 + 12 + 2  # the same, identifier extension and one reserved bit
    bits, count = bits << 4 | length, count + 4
    if not remote:
        bits = bits << 8 * length | int.from_bytes(data[:length], "big")
        count += 8 * length
    return _stuffed_length(bits, count) + _UNSTUFFED_BITS


def _stuffed_length(bits: int, count: int) -> int:
    """Return the length of `bits` (`count` of them) and their CRC, with a stuff bit after five equal bits.

    Both are computed byte by byte from tables, because a full bus carries 8,000 frames a second. The filling
    of the first byte has no effect: zeros do not change the CRC, and alternating bits that end recessive
    extend no run.
    """
    crc = 0
    for byte in bits.to_bytes((count + 7) // 8, "big"):
        crc = crc << 8 & 0x7FFF ^ _CRC[crc >> 7 ^ byte]
    bits, count = bits << 15 | crc, count + 15
    filling = -count % 8
    bits |= (0x55 & (1 << filling) - 1) << count
    stuffed, runs = 0, _STUFFED[_NO_RUN]
    for byte in bits.to_bytes((count + filling) // 8, "big"):
        more, run = runs[byte]
        stuffed += more
        runs = _STUFFED[run]
    return count + stuffed


def _crc_of(byte: int) -> int:
    crc = byte << 7
    for _ in range(8):
        crc = crc << 1 ^ (_CRC_POLYNOMIAL if crc & 0x4000 else 0)
    return crc & 0x7FFF


def _stuffed_by(run: tuple[int, int], byte: int) -> tuple[int, tuple[int, int]]:
    """Return the stuff bits within `byte` after a run (bit and length), and the run at its end."""
    stuffed, (previous, length) = 0, run
    for shift in range(7, -1, -1):
        bit = byte >> shift & 1
        length = length + 1 if bit == previous else 1
        previous = bit
        if length == 5:
            stuffed += 1
            previous, length = 1 - bit, 1  # the stuff bit itself starts the next run
    return stuffed, (previous, length)


_NO_RUN = (0, 0)
_RUNS = (_NO_RUN, *((bit, length) for bit in (0, 1) for length in range(1, 5)))
_CRC = tuple(_crc_of(byte) for byte in range(256))
_STUFFED = {run: tuple(_stuffed_by(run, byte) for byte in range(256)) for run in _RUNS}


def passes(header: int, filters: Filters) -> bool:
    """Whether one of `filters` (identifier and mask) accepts a frame; error frames always pass."""
    return bool(header & ERROR) or any((header ^ can_id) & mask == 0 for can_id, mask in filters)


def pack_filters(filters: Filters) -> bytes:
    """Return a packet of at most `MOST_FILTERS` filters; without any, only error frames pass."""
    return FILTERS + b"".join(FILTER.pack(can_id, mask) for can_id, mask in filters)


def unpack_filters(packet: bytes) -> Filters | None:
    """Return the filters of a packet; None if it is another packet or has inverted or error filters."""
    body = packet[1:]
    if packet[:1] != FILTERS or len(body) % FILTER.size or len(packet) > FILTERS_BYTES:
        return None
    filters = tuple(FILTER.iter_unpack(body))
    return None if any((can_id | mask) & ERROR for can_id, mask in filters) else filters


def is_frames(packet: bytes) -> bool:
    """Return whether a packet consists of frames, none with more than 8 data bytes."""
    size = len(packet)
    if not size or size % FRAME_BYTES or size > MOST_BYTES:
        return False
    return max(packet[4::FRAME_BYTES]) <= 8


def split(packet: bytes) -> list[bytes]:
    """Return the frames of a packet."""
    if len(packet) == FRAME_BYTES:
        return [packet]
    return [packet[at : at + FRAME_BYTES] for at in range(0, len(packet), FRAME_BYTES)]


def headers_of(packet: bytes) -> tuple[int, ...]:
    """Return the identifiers with flags of its frames, which determine the receivers of a packet."""
    return _HEADERS[len(packet) // FRAME_BYTES].unpack(packet)


def lost_frames(header: int, data: bytes | bytearray) -> int:
    """Return the number of lost frames that an error frame reports; 0 for other error frames."""
    if header & ERROR and header & CONTROLLER_PROBLEM and len(data) == 8 and data[1] & RECEIVE_OVERFLOW:
        return int.from_bytes(data[5:8], "big")
    return 0
