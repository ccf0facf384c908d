"""The hostile station: sends at full rate, reads what comes, and asks nodes whether they are alive."""

import secrets
import struct
import time
from collections.abc import Callable, Iterable
from itertools import islice
from typing import NamedTuple

import can

from tests.campaigns.hostile.frames import NMT, NODES, HostileFrame

READ_EVERY = 16
"""Frames sent between two looks at what has come."""
ANSWER_LIMIT_S, RESETS = 30.0, 3
ROOM_LIMIT_S = 60.0
"""Longest wait for room on the bus: on a busy computer its slowest reader may not run for seconds."""
RESET_NODE = 0x81
REQUEST = struct.Struct("<BHB4x")
UPLOAD, EXPEDITED, ABORT = 0x40, 0x43, 0x80
NO_OBJECT = 0x5E00
"""5E00h ... 5EFFh: no node has them."""


class Sent(NamedTuple):
    """Figures of a flood."""

    frames: int
    received: int
    seconds: float


def flood(
    bus: can.BusABC,
    frames: Iterable[HostileFrame],
    count: int,
    tell: Callable[[int], object] = lambda _n: None,
) -> Sent:
    """Send so many frames, as fast as the bus takes them; `tell` is called with the number sent lately."""
    begun_s, received, sent, since = time.monotonic(), 0, 0, 0
    send, receive = bus.send, bus.recv
    for frame in islice(frames, count):
        send(frame.message(), ROOM_LIMIT_S)
        sent += 1
        since += 1
        if since % READ_EVERY == 0:
            while receive(0) is not None:
                received += 1
        if since == 1000:
            tell(since)
            since = 0
    tell(since)
    return Sent(sent, received, time.monotonic() - begun_s)


def alive(bus: can.BusABC, node: int) -> bool:
    """Whether a node answers SDO requests, and its device type with what it is; requested again each second.

    Answers to what it was flooded with may still be on their way. So first an object is read that there
    is not and that nobody else asks for: behind that answer come only answers to us.
    """
    deadline_s = time.monotonic() + ANSWER_LIMIT_S
    nobodys = REQUEST.pack(UPLOAD, NO_OBJECT + secrets.randbelow(256), secrets.randbelow(256))
    return _answered(bus, node, nobodys, ABORT, deadline_s) and _answered(
        bus, node, REQUEST.pack(UPLOAD, 0x1000, 0), EXPEDITED, deadline_s
    )


def _answered(bus: can.BusABC, node: int, request: bytes, head: int, deadline_s: float) -> bool:
    """Whether an answer to this request comes that begins so."""
    wanted = bytes((head,)) + request[1:4]
    while time.monotonic() < deadline_s:
        bus.send(HostileFrame(0x600 + node, request).message(), ROOM_LIMIT_S)
        again_s = time.monotonic() + 1.0
        while (message := bus.recv(max(0.0, again_s - time.monotonic()))) is not None:
            if message.arbitration_id == 0x580 + node and message.data[:4] == wanted:
                return True
    return False


def silent_nodes(bus: can.BusABC) -> list[int]:
    """Simulated nodes that do not answer after a reset. It is sent again: nobody confirms it, and whoever is
    still busy with the flood may have lost it (the kernel drops what a socket's buffer has no room for).
    """
    return [node for node in NODES if not any(_alive_after_reset(bus, node) for _ in range(RESETS))]


def _alive_after_reset(bus: can.BusABC, node: int) -> bool:
    bus.send(HostileFrame(NMT, bytes((RESET_NODE, node))).message(), ROOM_LIMIT_S)
    return alive(bus, node)
