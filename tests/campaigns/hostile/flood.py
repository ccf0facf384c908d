"""The hostile station: sends at full rate, reads the bus, and checks by SDO that nodes respond."""

import secrets
import struct
import time
from collections.abc import Callable, Iterable
from itertools import islice
from typing import NamedTuple

import can

from tests.campaigns.hostile.frames import NMT, NODES, HostileFrame

READ_EVERY = 16
"""Frames sent between two reads of the bus."""
ANSWER_LIMIT_S, RESETS = 30.0, 3
"""Longest wait for the answer of a node, and resets before a node counts as silent."""
ROOM_LIMIT_S = 60.0
"""Longest wait for space on the bus: on a busy computer its slowest reader may not run for seconds."""
RESET_NODE = 0x81
REQUEST = struct.Struct("<BHB4x")
UPLOAD, EXPEDITED, ABORT = 0x40, 0x43, 0x80
NO_OBJECT = 0x5E00
"""First of the objects 5E00h to 5EFFh, which no node has."""


class Sent(NamedTuple):
    """Figures of a flood."""

    frames: int
    received: int
    seconds: float


def flood(
    bus: can.BusABC,
    frames: Iterable[HostileFrame],
    count: int,
    on_sent: Callable[[int], object] = lambda _n: None,
) -> Sent:
    """Send `count` frames as fast as the bus takes them; call `on_sent` with each thousand sent."""
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
            on_sent(since)
            since = 0
    on_sent(since)
    return Sent(sent, received, time.monotonic() - begun_s)


def responds(bus: can.BusABC, node: int) -> bool:
    """Return whether a node answers an SDO upload of its device type; it is requested each second.

    Answers to the flood may still be in transit. So an object that no node has and no other client requests
    is read first: after its abort, all answers are to this client.
    """
    deadline_s = time.monotonic() + ANSWER_LIMIT_S
    unused_object = REQUEST.pack(UPLOAD, NO_OBJECT + secrets.randbelow(256), secrets.randbelow(256))
    return _answered(bus, node, unused_object, ABORT, deadline_s) and _answered(
        bus, node, REQUEST.pack(UPLOAD, 0x1000, 0), EXPEDITED, deadline_s
    )


def _answered(bus: can.BusABC, node: int, request: bytes, head: int, deadline_s: float) -> bool:
    """Return whether an answer to this request begins with the command `head` before the deadline."""
    wanted = bytes((head,)) + request[1:4]
    while time.monotonic() < deadline_s:
        bus.send(HostileFrame(0x600 + node, request).message(), ROOM_LIMIT_S)
        again_s = time.monotonic() + 1.0
        while (message := bus.recv(max(0.0, again_s - time.monotonic()))) is not None:
            if message.arbitration_id == 0x580 + node and message.data[:4] == wanted:
                return True
    return False


def silent_nodes(bus: can.BusABC) -> list[int]:
    """Return the simulated nodes that do not respond after a reset.

    The reset is repeated: it is not confirmed, and a node that is still busy with the flood may have lost it
    (the kernel drops frames that do not fit into a socket's buffer).
    """
    return [node for node in NODES if not any(_responds_after_reset(bus, node) for _ in range(RESETS))]


def _responds_after_reset(bus: can.BusABC, node: int) -> bool:
    bus.send(HostileFrame(NMT, bytes((RESET_NODE, node))).message(), ROOM_LIMIT_S)
    return responds(bus, node)
