"""The bus port: dispatch in the asyncio thread, error frames as events, one line for a bus that is absent."""

from __future__ import annotations

import asyncio
import errno
import itertools
import socket
import struct
from typing import TYPE_CHECKING

import can
import pytest

from servo_ctrl.io import can_port
from servo_ctrl.io.can_port import (
    FRAMES_PER_WAKE,
    BusError,
    BusNews,
    CanPort,
    describe_error_frame,
    open_port,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

ERROR_FLAG = 0x2000_0000
EXTENDED_FLAG = 0x8000_0000
_FRAME = struct.Struct("=IB3x8s")


class SocketBus(can.BusABC):
    """One end of a socket pair as a bus; the other end is the test."""

    def __init__(self) -> None:
        super().__init__(channel="pair")
        self.near, self.far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.near.setblocking(False)

    def fileno(self) -> int:
        return self.near.fileno()

    def recv(self, timeout: float | None = None) -> can.Message | None:  # noqa: ARG002  # python-can's signature
        try:
            raw = self.near.recv(_FRAME.size)
        except BlockingIOError:
            return None
        if not raw:
            raise can.CanOperationError("the other end has gone")
        header, size, data = _FRAME.unpack(raw)
        return can.Message(
            arbitration_id=header & ~(ERROR_FLAG | EXTENDED_FLAG),
            data=data[:size],
            is_extended_id=bool(header & EXTENDED_FLAG),
            is_error_frame=bool(header & ERROR_FLAG),
        )

    def send(self, msg: can.Message, timeout: float | None = None) -> None:  # noqa: ARG002  # the same
        try:
            self.near.send(_FRAME.pack(msg.arbitration_id, msg.dlc, bytes(msg.data)))
        except OSError as error:
            raise can.CanOperationError(str(error)) from error

    def shutdown(self) -> None:
        super().shutdown()
        self.near.close()

    def put(self, can_id: int, data: bytes = b"") -> None:
        """A frame from the other side."""
        self.far.send(_FRAME.pack(can_id, len(data), data))

    def taken(self) -> tuple[int, bytes]:
        """A frame that was sent to the other side."""
        header, size, data = _FRAME.unpack(self.far.recv(_FRAME.size))
        return header, data[:size]


@pytest.fixture
def bus() -> Iterator[SocketBus]:
    made = SocketBus()
    yield made
    made.far.close()
    made.shutdown()


@pytest.fixture
def port(bus: SocketBus) -> CanPort:
    return CanPort(bus, "pair")


async def test_frames_go_to_their_handler_and_the_rest_to_the_fallback(bus: SocketBus, port: CanPort) -> None:
    handled: list[bytes] = []
    rest: list[tuple[int, bytes]] = []
    done = asyncio.Event()

    def fallback(can_id: int, data: bytearray, _timestamp_s: float) -> None:
        rest.append((can_id, bytes(data)))
        if can_id == 0x583:
            done.set()

    port.handlers[0x181] = lambda data, _timestamp_s: handled.append(bytes(data))
    port.fallback = fallback
    port.attach(asyncio.get_running_loop())
    for frame in ((0x181, b"\x01\x02"), (0x581, b"\x60"), (0x181, b"\x03"), (0x583, b"")):
        bus.put(*frame)
    await asyncio.wait_for(done.wait(), 2.0)
    port.detach()
    assert handled == [b"\x01\x02", b"\x03"]
    assert rest == [(0x581, b"\x60"), (0x583, b"")]


async def test_extended_frame_is_not_taken_for_a_standard_one(bus: SocketBus, port: CanPort) -> None:
    """Other protocols may use 29 bits on the same wire; their 181h is no TPDO."""
    heard: list[bytes] = []
    done = asyncio.Event()
    port.handlers[0x181] = lambda data, _timestamp_s: heard.append(bytes(data))
    port.handlers[0x182] = lambda _data, _timestamp_s: done.set()
    port.attach(asyncio.get_running_loop())
    for can_id in (EXTENDED_FLAG | 0x181, 0x181, 0x182):
        bus.put(can_id, can_id.to_bytes(4, "big"))
    await asyncio.wait_for(done.wait(), 2.0)
    port.detach()
    assert heard == [(0x181).to_bytes(4, "big")]


class FullQueue:
    """Refuses the first frames as SocketCAN does while its transmit queue is full."""

    def __init__(self, refusals: int, code: int) -> None:
        self.refusals, self.code, self.sent = refusals, code, 0

    def __call__(self, _message: can.Message) -> None:
        if self.refusals:
            self.refusals -= 1
            raise can.CanOperationError("Failed to transmit: refused", self.code)
        self.sent += 1


def test_full_transmit_queue_is_waited_for(
    bus: SocketBus, port: CanPort, monkeypatch: pytest.MonkeyPatch
) -> None:
    queue = FullQueue(3, errno.ENOBUFS)
    monkeypatch.setattr(bus, "send", queue)
    port.frame(0x080, 0).send(b"")
    port.send(0x601, bytes(8))
    assert queue.sent == 2


@pytest.mark.parametrize(
    ("code", "advice"),
    [
        (errno.ENOBUFS, "check that a node is on, the cable, termination and bit rate"),
        (errno.ENETDOWN, "the interface is down; `ip link set"),
    ],
)
def test_bus_that_takes_no_frames_is_given_up_with_advice(
    bus: SocketBus, port: CanPort, monkeypatch: pytest.MonkeyPatch, code: int, advice: str
) -> None:
    said: list[str] = []
    port.on_down = lambda error: said.append(str(error))
    monkeypatch.setattr(bus, "send", FullQueue(10**9, code))
    port.frame(0x080, 0).send(b"")
    assert len(said) == 1
    assert advice in said[0]


async def test_answer_that_cannot_be_sent_takes_the_port_down(bus: SocketBus, port: CanPort) -> None:
    """Our node's SDO server answers from within the reader."""
    down: asyncio.Future[BusError] = asyncio.get_running_loop().create_future()
    port.on_down = down.set_result
    port.fallback = lambda _can_id, _data, _timestamp_s: port.send(0x5FF, bytes(8))
    port.attach(asyncio.get_running_loop())
    bus.put(0x67F, bytes(8))
    bus.far.close()
    assert "cannot send" in str(await asyncio.wait_for(down, 2.0))


async def test_full_bus_does_not_starve_the_loop(bus: SocketBus, port: CanPort) -> None:
    count = 0
    seen_by_timer: list[int] = []

    def answer(_data: bytearray, _timestamp_s: float) -> None:
        nonlocal count
        count += 1
        if count < 10 * FRAMES_PER_WAKE:
            bus.put(0x100)  # the bus never rests

    port.handlers[0x100] = answer
    port.attach(asyncio.get_running_loop())
    bus.put(0x100)
    while count < 10 * FRAMES_PER_WAKE:
        await asyncio.sleep(0)
        seen_by_timer.append(count)
    port.detach()
    steps = [after - before for before, after in itertools.pairwise(seen_by_timer)]
    assert max(steps) <= FRAMES_PER_WAKE


async def test_what_has_waited_is_taken_before_the_cycle_begins(bus: SocketBus, port: CanPort) -> None:
    """The bus goes on behind it, and sends what does not fit in the socket as soon as there is room."""
    rest = iter(range(3000))
    numbers: list[int] = []

    def refill(_data: bytearray, _timestamp_s: float) -> None:
        numbers.append(len(numbers))
        if next(rest, None) is not None:
            bus.put(0x7E0)

    port.handlers[0x7E0] = refill
    port.attach(asyncio.get_running_loop())
    for _ in range(50):
        bus.put(0x7E0)
    await port.caught_up()
    assert len(numbers) == 3050


async def test_bus_that_never_rests_does_not_keep_the_cycle_from_beginning(
    bus: SocketBus, port: CanPort, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(can_port, "MOST_LOOKS", 3)
    monkeypatch.setattr(can_port, "FRAMES_A_LOOK", 0)
    port.handlers[0x7E0] = lambda _data, _timestamp_s: bus.put(0x7E0)
    port.attach(asyncio.get_running_loop())
    bus.put(0x7E0)
    await port.caught_up()
    assert port.frames > 0


async def test_bus_that_fails_is_reported_once_and_read_no_more(bus: SocketBus, port: CanPort) -> None:
    said: list[str] = []
    down = asyncio.Event()

    def on_down(error: BusError) -> None:
        said.append(str(error))
        down.set()

    port.on_down = on_down
    port.attach(asyncio.get_running_loop())
    bus.far.close()
    await asyncio.wait_for(down.wait(), 2.0)
    await asyncio.sleep(0)
    assert said == ["bus pair failed: the other end has gone"]


def test_cyclic_frame_carries_each_payload(bus: SocketBus, port: CanPort) -> None:
    frame = port.frame(0x201, 3)
    frame.send(b"abc")
    frame.send(b"xyz")
    assert [bus.taken(), bus.taken()] == [(0x201, b"abc"), (0x201, b"xyz")]


def test_frame_that_cannot_be_sent_takes_the_port_down(bus: SocketBus, port: CanPort) -> None:
    said: list[BusError] = []
    port.on_down = said.append
    bus.far.close()
    port.frame(0x080, 0).send(b"")
    assert len(said) == 1
    with pytest.raises(BusError, match="bus pair: cannot send"):
        port.send(0x601, bytes(8))


async def test_error_frame_is_an_event(bus: SocketBus, port: CanPort) -> None:
    news: list[BusNews] = []
    heard = asyncio.Event()
    port.on_error_frame = lambda said: (news.append(said), heard.set())[0]
    port.attach(asyncio.get_running_loop())
    bus.put(ERROR_FLAG | 0x004, b"\x00\x01\x00\x00\x00\x00\x00\x00")
    await asyncio.wait_for(heard.wait(), 2.0)
    port.detach()
    assert news == [BusNews("receive overrun: frames were lost", frames_lost=True, down=False)]


@pytest.mark.parametrize(
    ("error_class", "payload", "lost", "down", "text"),
    [
        (0x040, b"", True, True, "bus-off"),
        (0x044, b"\x00\x20", True, True, "bus-off"),
        (0x004, b"\x00\x02", True, False, "transmit overrun: frames were lost"),
        (0x004, b"\x00\x10", False, False, "error passive"),
        (0x004, b"\x00\x08", False, False, "error warning"),
        (0x100, b"", False, False, "controller restarted"),
        (0x020, b"", False, False, "no acknowledge on transmission"),
        (0x200, b"", False, False, "error frame of class 0x200"),
    ],
)
def test_error_frames_in_words(error_class: int, payload: bytes, lost: bool, down: bool, text: str) -> None:
    assert describe_error_frame(error_class, payload) == BusNews(text, lost, down)


@pytest.mark.parametrize(
    ("spec", "complaint"),
    [
        ("vcan0", "must be INTERFACE:CHANNEL"),
        ("socketcan:", "must be INTERFACE:CHANNEL"),
        (":vcan0", "must be INTERFACE:CHANNEL"),
        ("nosuch:vcan0", "cannot be opened: Unknown interface type"),
        ("localcan:/no/such/hub.sock", "cannot be opened: no hub at /no/such/hub.sock"),
        ("socketcan:nosuchcan9", "cannot be opened: "),
    ],
)
def test_bus_that_is_not_there_is_one_line(spec: str, complaint: str) -> None:
    with pytest.raises(BusError, match=complaint) as caught:
        open_port(spec)
    assert "\n" not in str(caught.value)


async def test_port_that_wants_one_identifier_hears_no_other() -> None:
    heard: list[int] = []
    port = open_port("virtual:filtered", only=(0x5FF,))
    with can.Bus(interface="virtual", channel="filtered") as other:
        for can_id in (0x080, 0x181, 0x5FF, 0x701):
            other.send(can.Message(arbitration_id=can_id, is_extended_id=False))
        port.fallback = lambda can_id, _data, _timestamp_s: heard.append(can_id)
        for _ in range(4):
            port._drain()
    port.close()
    assert heard == [0x5FF]


async def test_interface_without_a_file_descriptor_is_refused() -> None:
    port = open_port("virtual:portless")
    try:
        with pytest.raises(BusError, match="no file to wait on"):
            port.attach(asyncio.get_running_loop())
    finally:
        port.close()


def test_kernel_without_socketcan_is_sent_to_the_embedded_bus(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(**_: object) -> None:
        raise OSError(errno.EAFNOSUPPORT, "Address family not supported by protocol")

    monkeypatch.setattr(can, "Bus", refuse)
    with pytest.raises(BusError, match=r"has no SocketCAN; use localcan:SOCKET with `python -m local_can"):
        open_port("socketcan:vcan0")
