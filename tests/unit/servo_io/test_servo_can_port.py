"""The bus port: dispatch in the asyncio thread, error frames as events."""

import asyncio
import errno
import itertools
from collections.abc import Iterator

import can
import pytest
from socket_bus import ERROR_FLAG, EXTENDED_FLAG, SocketBus

from servo_ctrl.io import can_port
from servo_ctrl.io.can_port import FRAMES_PER_WAKE, BusError, CanPort
from servo_ctrl.io.error_frames import BusNews


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


async def test_extended_frame_is_not_mistaken_for_a_standard_one(bus: SocketBus, port: CanPort) -> None:
    """Other protocols may use 29 bits on the same wire; their 181h is not a TPDO."""
    received: list[bytes] = []
    done = asyncio.Event()
    port.handlers[0x181] = lambda data, _timestamp_s: received.append(bytes(data))
    port.handlers[0x182] = lambda _data, _timestamp_s: done.set()
    port.attach(asyncio.get_running_loop())
    for can_id in (EXTENDED_FLAG | 0x181, 0x181, 0x182):
        bus.put(can_id, can_id.to_bytes(4, "big"))
    await asyncio.wait_for(done.wait(), 2.0)
    port.detach()
    assert received == [(0x181).to_bytes(4, "big")]


class FullQueue:
    """Refuses the first frames as SocketCAN does while its transmit queue is full."""

    def __init__(self, refusals: int, code: int) -> None:
        self.refusals, self.code, self.sent = refusals, code, 0

    def __call__(self, _message: can.Message, _timeout_s: float | None) -> None:
        if self.refusals:
            self.refusals -= 1
            raise can.CanOperationError("Failed to transmit: refused", self.code)
        self.sent += 1


def test_sending_waits_for_a_full_transmit_queue(
    bus: SocketBus, port: CanPort, monkeypatch: pytest.MonkeyPatch
) -> None:
    queue = FullQueue(1, errno.ENOBUFS)  # on a busy computer the wait may end with the second try
    monkeypatch.setattr(bus, "send", queue)
    port.frame(0x080).send(b"")
    port.flush()
    port.send(0x601, bytes(8))
    assert queue.sent == 2


@pytest.mark.parametrize(
    ("code", "advice"),
    [
        (errno.ENOBUFS, "check that a node is on, the cable, termination and bit rate"),
        (errno.ENETDOWN, "the interface is down; `ip link set"),
    ],
)
def test_bus_that_accepts_no_frames_is_an_error_with_advice(
    bus: SocketBus, port: CanPort, monkeypatch: pytest.MonkeyPatch, code: int, advice: str
) -> None:
    errors: list[str] = []
    port.on_down = lambda error: errors.append(str(error))
    monkeypatch.setattr(bus, "send", FullQueue(10**9, code))
    port.frame(0x080).send(b"")
    port.flush()
    assert len(errors) == 1
    assert advice in errors[0]


async def test_answer_that_cannot_be_sent_takes_the_port_down(bus: SocketBus, port: CanPort) -> None:
    """Our node's SDO server answers from within the reader."""
    down: asyncio.Future[BusError] = asyncio.get_running_loop().create_future()
    port.on_down = down.set_result
    port.fallback = lambda _can_id, _data, _timestamp_s: port.send(0x5FF, bytes(8))
    port.attach(asyncio.get_running_loop())
    bus.put(0x67F, bytes(8))
    bus.far.close()
    assert "cannot send" in str(await asyncio.wait_for(down, 2.0))


async def test_full_bus_does_not_starve_the_event_loop(bus: SocketBus, port: CanPort) -> None:
    count = 0
    seen_by_timer: list[int] = []

    def answer(_data: bytearray, _timestamp_s: float) -> None:
        nonlocal count
        count += 1
        if count < 10 * FRAMES_PER_WAKE:
            bus.put(0x100)  # the bus is never idle

    port.handlers[0x100] = answer
    port.attach(asyncio.get_running_loop())
    bus.put(0x100)
    while count < 10 * FRAMES_PER_WAKE:
        await asyncio.sleep(0)
        seen_by_timer.append(count)
    port.detach()
    steps = [after - before for before, after in itertools.pairwise(seen_by_timer)]
    assert max(steps) <= FRAMES_PER_WAKE


async def test_queued_frames_are_read_before_the_cycle_begins(bus: SocketBus, port: CanPort) -> None:
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


async def test_busy_bus_does_not_delay_the_cycle(
    bus: SocketBus, port: CanPort, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(can_port, "CATCH_UP_STEPS", 3)
    monkeypatch.setattr(can_port, "FRAMES_PER_STEP_MAX", 0)
    port.handlers[0x7E0] = lambda _data, _timestamp_s: bus.put(0x7E0)
    port.attach(asyncio.get_running_loop())
    bus.put(0x7E0)
    await port.caught_up()
    assert port.frames > 0


async def test_bus_that_fails_is_reported_once_and_read_no_more(bus: SocketBus, port: CanPort) -> None:
    errors: list[str] = []
    down = asyncio.Event()

    def on_down(error: BusError) -> None:
        errors.append(str(error))
        down.set()

    port.on_down = on_down
    port.attach(asyncio.get_running_loop())
    bus.far.close()
    await asyncio.wait_for(down.wait(), 2.0)
    await asyncio.sleep(0)
    assert errors == ["bus pair failed: the other end has gone"]


def test_cyclic_frame_carries_each_payload(bus: SocketBus, port: CanPort) -> None:
    frame = port.frame(0x201)
    frame.send(b"abc")
    frame.send(b"xyz")
    port.flush()
    assert [bus.take_sent(), bus.take_sent()] == [(0x201, b"abc"), (0x201, b"xyz")]


def test_frame_that_cannot_be_sent_takes_the_port_down(bus: SocketBus, port: CanPort) -> None:
    errors: list[BusError] = []
    port.on_down = errors.append
    bus.far.close()
    port.frame(0x080).send(b"")
    port.flush()
    assert len(errors) == 1
    with pytest.raises(BusError, match="bus pair: cannot send"):
        port.send(0x601, bytes(8))


async def test_error_frame_is_an_event(bus: SocketBus, port: CanPort) -> None:
    news: list[BusNews] = []
    received = asyncio.Event()
    port.on_error_frame = lambda errors: (news.append(errors), received.set())[0]
    port.attach(asyncio.get_running_loop())
    bus.put(ERROR_FLAG | 0x004, b"\x00\x01\x00\x00\x00\x00\x00\x00")
    await asyncio.wait_for(received.wait(), 2.0)
    port.detach()
    assert news == [BusNews("receive overrun: frames were lost", frames_lost=True, down=False)]


async def test_nothing_is_sent_or_taken_between_bus_off_and_the_restart(
    bus: SocketBus, port: CanPort
) -> None:
    news: asyncio.Queue[BusNews] = asyncio.Queue()
    came: asyncio.Queue[int] = asyncio.Queue()
    port.on_error_frame = news.put_nowait
    port.fallback = lambda can_id, _data, _timestamp_s: came.put_nowait(can_id)
    port.attach(asyncio.get_running_loop())
    for can_id, data in (
        (ERROR_FLAG | 0x100, b""),  # a restart that nothing went before
        (0x181, b""),
        (ERROR_FLAG | 0x040, b""),
        (0x182, b""),
        (ERROR_FLAG | 0x004, b"\0\x10"),  # passive: still off
        (0x183, b""),
    ):
        bus.put(can_id, data)
    reports = [await asyncio.wait_for(news.get(), 2.0) for _ in range(3)]
    assert port.off
    port.send(0x601, bytes(8))
    port.frame(0x080).send(b"")
    port.flush()
    bus.put(ERROR_FLAG | 0x100, b"")
    bus.put(0x184, b"")
    reports.append(await asyncio.wait_for(news.get(), 2.0))
    taken = [await asyncio.wait_for(came.get(), 2.0) for _ in range(2)]
    port.detach()
    assert taken == [0x181, 0x184]
    assert [each.down for each in reports] == [False, True, False, False]
    assert [each.restarted for each in reports] == [False, False, False, True]
    port.send(0x602, b"")
    assert bus.take_sent() == (0x602, b"")
