"""Fuzz targets: packets to localcan's hub and clients."""

import socket
import struct
from collections.abc import Sequence

import can

from local_can import wire
from local_can.bus import LocalCanBus
from tests.campaigns.hostile.bus_records import MOST_FRAMES, traffic
from tests.campaigns.hostile.targets import target


@target("local_can.bus", traffic, declared=can.CanError, words=(b"\x09", b"\0\0\0\x20", b"\0\0\0\xe0"))
def packets_to_a_client(data: bytes) -> None:
    """Read packets of a false hub as a client."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with ours, theirs:
        bus = LocalCanBus.__new__(LocalCanBus)
        bus.channel, bus.channel_info, bus.lost_frames = "fuzz", "fuzz", 0
        bus._socket, bus._filters, bus._buffer = ours, None, bytearray(wire.FRAME_BYTES)
        bus._filters_itself = False
        bus._socket_send, bus._receive_into = ours.send, ours.recv_into
        bus._is_shutdown = True
        ours.setblocking(False)
        for start in range(0, min(len(data), 16 * MOST_FRAMES), 16):
            theirs.send(data[start : start + 16])
            message = bus.recv(0)
            assert message is not None
            assert len(message.data) <= 8
            str(message)


@target("local_can.wire", traffic, words=(b"\0\0\0\x20", b"\0\0\0\x80"))
def frames_in_the_hub(data: bytes) -> None:
    """Compute rank and length in bits of every valid frame."""
    for start in range(0, len(data) // 16 * 16, 16):
        frame = data[start : start + 16]
        if frame[4] <= 8:
            assert wire.arbitration_rank(frame) >= -1
            assert 17 <= wire.frame_bits(frame) <= 160
            wire.lost_frames(*struct.unpack_from("=I", frame), frame[8 : 8 + frame[4]])


def _filters() -> Sequence[bytes]:
    some = ((0x080, 0x7FF | wire.EXTENDED), (0x180, 0x780), (wire.EXTENDED | 0x123, 0x1FFF_FFFF))
    return [wire.pack_filters(()), wire.pack_filters(some), wire.pack_filters(wire.PASS_ALL * 513)]


@target("local_can.wire", _filters, words=(wire.FILTERS, b"\0\0\0\x20", b"\0\0\0\x80", bytes(8)))
def filters_in_the_hub(data: bytes) -> None:
    """Apply a client's filters: refused, or they decide on every frame and pass each error frame."""
    filters = wire.unpack_filters(data)
    if filters is None:
        return
    assert len(filters) <= wire.MOST_FILTERS
    assert wire.pack_filters(filters) == data
    assert wire.passes(wire.ERROR | 0x004, filters)
    for can_id, mask in filters:
        header = can_id & (wire.EXTENDED | wire.EXTENDED_ID_MASK)
        assert wire.passes(header, filters) or (can_id ^ header) & mask
