"""Bursts through a bus: SocketCAN's own bytes, shown by a socket pair, and python-can's messages."""

import contextlib
import errno
import socket
from collections.abc import Iterator
from typing import Any

import can
import pytest
from can.interfaces.socketcan import SocketcanBus
from can.interfaces.socketcan.socketcan import build_can_frame

from can_frames.frame import FRAME, pack_frame
from can_frames.frame_bus import SendTimeouts, frame_bus

SEND_TIMEOUTS = SendTimeouts(queue_s=1.0, interface_s=1.0)
BRIEF = SendTimeouts(queue_s=1e-3, interface_s=1.0)


class PairedSocketcan(SocketcanBus):
    """SocketCAN's bus on one end of a socket pair; the kernel of a test may have no CAN."""

    def __init__(self) -> None:
        self.socket, self.far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._is_shutdown = True


@pytest.fixture
def paired() -> Iterator[PairedSocketcan]:
    bus = PairedSocketcan()
    with bus.socket, bus.far:
        yield bus


@pytest.fixture
def virtual() -> Iterator[tuple[can.BusABC, can.BusABC]]:
    with (
        can.Bus(interface="virtual", channel="frames") as near,
        can.Bus(interface="virtual", channel="frames") as far,
    ):
        yield near, far


def test_frames_are_those_of_socketcan(paired: PairedSocketcan) -> None:
    message = can.Message(arbitration_id=0x181, data=b"\1\2\3", is_extended_id=False)
    paired.far.send(build_can_frame(message))
    paired.far.send(build_can_frame(message))
    bus = frame_bus(paired, SEND_TIMEOUTS)
    bursts = list(bus.waiting())  # both in one system call
    assert [list(FRAME.iter_unpack(burst)) for burst in bursts] == [
        [(0x181, 3, b"\1\2\3".ljust(8, b"\0"))] * 2
    ]
    bus.send(pack_frame(0x201, bytes(8)) + pack_frame(0x80, b""))
    assert [paired.far.recv(16), paired.far.recv(16)] == [pack_frame(0x201, bytes(8)), pack_frame(0x80, b"")]


def test_a_full_queue_is_waited_for_and_then_an_error(paired: PairedSocketcan) -> None:
    with contextlib.suppress(BlockingIOError):
        while True:
            paired.socket.send(bytes(16), socket.MSG_DONTWAIT)
    with pytest.raises(BlockingIOError):
        frame_bus(paired, BRIEF).send(pack_frame(0x201, bytes(8)))


def test_messages_of_any_interface_become_frames_and_back(virtual: tuple[can.BusABC, can.BusABC]) -> None:
    near, far = virtual
    for flags in (
        {"is_extended_id": False},
        {"is_extended_id": True},
        {"is_extended_id": False, "is_remote_frame": True},
        {"is_extended_id": False, "is_error_frame": True},
        {"is_extended_id": False, "is_fd": True},
    ):
        far.send(can.Message(arbitration_id=0x181, **flags))
    bus = frame_bus(near, SEND_TIMEOUTS)
    headers = [int.from_bytes(burst[:4], "little") for burst in bus.waiting()]
    assert headers == [0x181, 0x8000_0181, 0x4000_0181, 0x2000_0181, 0x8000_0181]
    bus.send(pack_frame(0x201, b"\7") + pack_frame(0x80, b""))
    received = [far.recv(1.0), far.recv(1.0)]
    assert [(one.arbitration_id, bytes(one.data)) for one in received if one] == [(0x201, b"\7"), (0x80, b"")]


def test_an_interface_whose_queue_stays_full_is_an_error() -> None:
    refusals = 0

    def send(_message: can.Message, _timeout_s: float | None) -> None:
        nonlocal refusals
        refusals += 1
        raise can.CanOperationError("no room", errno.ENOBUFS)

    full: Any = type("Full", (), {"send": staticmethod(send)})()
    with pytest.raises(can.CanOperationError, match="no room"):
        frame_bus(full, BRIEF).send(pack_frame(0x80, b""))
    assert refusals > 1
