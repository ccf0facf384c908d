"""Arbitration and bit counting against values worked out by hand and by another formulation."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from can_frames.frame import overrun_frame
from local_can import wire


def frame(identifier: int, data: bytes = b"", *, extended: bool = False, remote: bool = False) -> bytes:
    flags = extended << 31 | remote << 30
    return struct.pack("=IB3x8s", identifier | flags, len(data), data)


standard_ids = st.integers(0, 0x7FF)
payloads = st.binary(max_size=8)


def test_a_lower_identifier_beats_a_higher_one() -> None:
    identifiers = [0x181, 0x080, 0x7FF, 0x000, 0x701]
    assert sorted(identifiers, key=lambda i: wire.arbitration_rank(frame(i))) == sorted(identifiers)


def test_data_beats_remote_and_standard_beats_extended_at_equal_leading_bits() -> None:
    order = [
        frame(0x123),
        frame(0x123, remote=True),
        frame(0x123 << 18, extended=True),
        frame(0x123 << 18, extended=True, remote=True),
        frame(0x123 << 18 | 1, extended=True),
        frame(0x124),
    ]
    assert sorted(order, key=wire.arbitration_rank) == order


def test_an_error_frame_comes_before_everything() -> None:
    assert wire.arbitration_rank(overrun_frame(1)) < wire.arbitration_rank(frame(0))


def bits_by_text(identifier: int, data: bytes, *, extended: bool = False) -> int:
    """Length of a data frame, counted on strings of 0 and 1: CRC by polynomial division."""
    sent = f"{identifier >> 18:011b}11{identifier & 0x3FFFF:018b}" if extended else f"{identifier:011b}"
    text = f"0{sent}000{len(data):04b}" + "".join(f"{byte:08b}" for byte in data)
    remainder = int(text, 2) << 15
    divisor = 0b1100010110011001
    while remainder.bit_length() >= 16:
        remainder ^= divisor << (remainder.bit_length() - 16)
    stuffed = ""
    for bit in text + f"{remainder:015b}":
        stuffed += bit
        if stuffed.endswith(("00000", "11111")) and len(set(stuffed[-5:])) == 1:
            stuffed += "1" if bit == "0" else "0"
    return len(stuffed) + 1 + 2 + 7 + 3


runs = st.lists(st.sampled_from([0x00, 0xFF, 0x1F, 0xE0, 0x3C, 0xC3]), max_size=8).map(bytes)


@given(identifier=standard_ids, data=payloads | runs)
def test_frame_bits_equal_a_count_on_text(identifier: int, data: bytes) -> None:
    # A stuff bit may itself be one of five equal bits: text of six equal bits never occurs.
    assert wire.frame_bits(frame(identifier, data)) == bits_by_text(identifier, data)


@given(identifier=st.integers(0, 0x1FFFFFFF), data=payloads | runs)
def test_extended_frame_bits_equal_a_count_on_text(identifier: int, data: bytes) -> None:
    expected = bits_by_text(identifier, data, extended=True)
    assert wire.frame_bits(frame(identifier, data, extended=True)) == expected


@given(identifier=standard_ids, data=payloads)
def test_frame_bits_lie_between_nominal_and_worst_stuffing(identifier: int, data: bytes) -> None:
    nominal = 47 + 8 * len(data)
    assert nominal <= wire.frame_bits(frame(identifier, data)) <= nominal + (33 + 8 * len(data)) // 4


@given(identifier=st.integers(0, 0x1FFFFFFF), data=payloads)
def test_extended_frame_bits_lie_between_nominal_and_worst_stuffing(identifier: int, data: bytes) -> None:
    nominal = 67 + 8 * len(data)
    bits = wire.frame_bits(frame(identifier, data, extended=True))
    assert nominal <= bits <= nominal + (53 + 8 * len(data)) // 4


def test_an_alternating_frame_needs_few_stuff_bits() -> None:
    # SYNC: 0 00010000000 000 0000 and its CRC; the first stuff bits by hand in the text count above.
    assert wire.frame_bits(frame(0x080)) == bits_by_text(0x080, b"")
    assert wire.frame_bits(frame(0x555, b"\x55" * 8)) < wire.frame_bits(frame(0x000, b"\x00" * 8))


def test_a_remote_frame_carries_no_data_bits() -> None:
    assert wire.frame_bits(frame(0x2AA, remote=True)) < 47 + 16


@pytest.mark.parametrize(("lost", "reported"), [(1, 1), (300_000, 300_000), (1 << 30, (1 << 24) - 1)])
def test_an_overrun_frame_counts_the_loss(lost: int, reported: int) -> None:
    header, length, data = struct.unpack("=IB3x8s", overrun_frame(lost))
    assert (header, length) == (0x2000_0004, 8)
    assert data[1] == 0x01
    assert wire.lost_frames(header, data) == reported


def test_other_error_frames_report_no_loss() -> None:
    assert wire.lost_frames(0x2000_0040, bytes(8)) == 0
    assert wire.lost_frames(0x2000_0004, bytes(8)) == 0
    assert wire.lost_frames(0x004, b"\x00\x01\x00\x00\x00\x00\x00\x09") == 0
