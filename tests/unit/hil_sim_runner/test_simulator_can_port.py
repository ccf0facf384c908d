"""The simulator's CAN port on python-can's virtual interface."""

import errno
from collections.abc import Iterator
from typing import cast

import can
import pytest

from can_frames.frame_bus import SendTimeouts
from hil_sim.runner.can_port import BusError, CanPort, open_bus


@pytest.fixture
def other() -> Iterator[can.BusABC]:
    with can.Bus(interface="virtual", channel="port") as bus:
        yield bus


@pytest.fixture
def port() -> Iterator[CanPort]:
    with open_bus("virtual:port") as bus:
        yield CanPort(bus)


def drained(port: CanPort, frames: int) -> list[tuple[int, bytes]]:
    """Return received frames after so many wakes; one may end at a frame that python-can filters out."""
    received: list[tuple[int, bytes]] = []
    for _ in range(frames):
        port.drain(lambda can_id, data: received.append((can_id, data)))
    return received


def test_frames_go_out_as_standard_data_frames(port: CanPort, other: can.BusABC) -> None:
    port.send(0x181, b"\x01\x02")
    port.send(0x181, b"")
    port.flush()
    first, second = other.recv(1), other.recv(1)
    assert (first.arbitration_id, bytes(first.data), first.dlc, first.is_extended_id) == (
        0x181,
        b"\1\2",
        2,
        False,
    )
    assert (bytes(second.data), second.dlc) == (b"", 0)


def test_only_standard_frames_come_in_in_order_and_remote_ones_apart(
    port: CanPort, other: can.BusABC
) -> None:
    for message in (
        can.Message(arbitration_id=0x80, is_extended_id=False),
        can.Message(arbitration_id=0x201, is_extended_id=True, data=b"\1"),
        can.Message(arbitration_id=0x201, is_extended_id=False, is_remote_frame=True),
        can.Message(arbitration_id=0x201, is_extended_id=False, data=b"\2"),
    ):
        other.send(message)
    asked: list[int] = []
    port.on_remote = asked.append
    assert drained(port, 4) == [(0x80, b""), (0x201, b"\2")]
    assert asked == [0x201]


def test_exactly_the_frames_that_a_node_may_receive_are_received(port: CanPort, other: can.BusABC) -> None:
    for can_id in range(0x800):
        other.send(can.Message(arbitration_id=can_id, is_extended_id=False))
    assert [can_id for can_id, _data in drained(port, 0x800)] == [*range(0x780), 0x7E5]


@pytest.mark.parametrize(
    ("error_class", "data", "reports"),
    [
        (0x004, b"\0\x01", 1),
        (0x004, b"\0\x02\0\0", 1),
        (0x004, b"\0\x04", 0),
        (0x040, b"\0\x01", 0),
        (0x004, b"", 0),
    ],
)
def test_an_overrun_is_reported(
    port: CanPort, other: can.BusABC, error_class: int, data: bytes, reports: int
) -> None:
    count: list[None] = []
    port.on_overrun = lambda: count.append(None)
    other.send(can.Message(arbitration_id=error_class, is_extended_id=False, is_error_frame=True, data=data))
    port.drain(lambda _can_id, _data: None)
    assert len(count) == reports


def test_a_bus_that_fails_is_one_error(port: CanPort) -> None:
    port._bus.shutdown()
    port.send(0x80, b"")
    with pytest.raises(BusError, match="bus Virtual bus channel port"):
        port.flush()
    with pytest.raises(BusError, match="closed"):
        port.drain(lambda _can_id, _data: None)


class FullBus:
    """A SocketCAN adapter whose queue has no room for the first `refusals` sends."""

    channel_info = "full"

    def __init__(self, refusals: int, code: int) -> None:
        self.refusals = refusals
        self.code = code
        self.sent = 0

    def send(self, _message: can.Message, _timeout: float) -> None:
        if self.refusals:
            self.refusals -= 1
            raise can.CanOperationError("Failed to transmit", self.code)
        self.sent += 1


def put(bus: FullBus) -> None:
    port = CanPort(cast("can.BusABC", bus))
    port.send(0x581, bytes(8))
    port.flush()


def test_sending_waits_for_a_full_transmit_queue() -> None:
    bus = FullBus(20, errno.ENOBUFS)
    put(bus)
    assert bus.sent == 1


def test_sending_does_not_wait_for_a_bus_that_is_down() -> None:
    bus = FullBus(1, errno.ENETDOWN)
    with pytest.raises(BusError, match="bus full: Failed to transmit"):
        put(bus)
    assert bus.sent == 0


def test_a_queue_that_stays_full_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hil_sim.runner.can_port.SEND_TIMEOUTS", SendTimeouts(queue_s=0.01, interface_s=0.01))
    with pytest.raises(BusError, match="bus full"):
        put(FullBus(10**9, errno.ENOBUFS))


@pytest.mark.parametrize(("restart_class", "data"), [(0x100, b""), (0x004, b"\0\x40")])
def test_between_bus_off_and_restart_nodes_hear_nothing_and_are_not_heard(
    port: CanPort, other: can.BusABC, restart_class: int, data: bytes
) -> None:
    restarts: list[None] = []
    port.on_restart = lambda: restarts.append(None)

    def error(error_class: int, data: bytes = b"") -> None:
        other.send(
            can.Message(arbitration_id=error_class, is_extended_id=False, is_error_frame=True, data=data)
        )
        drained(port, 1)

    error(restart_class, data)
    error(0x040)
    other.send(can.Message(arbitration_id=0x80, is_extended_id=False))
    assert drained(port, 1) == []
    port.send(0x181, b"")
    port.flush()
    assert restarts == []
    error(restart_class, data)
    assert len(restarts) == 1
    other.send(can.Message(arbitration_id=0x81, is_extended_id=False))
    assert drained(port, 1) == [(0x81, b"")]
    port.send(0x182, b"")
    port.flush()
    sent = other.recv(1)
    assert sent is not None
    assert sent.arbitration_id == 0x182
