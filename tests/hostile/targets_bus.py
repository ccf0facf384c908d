"""Targets: what comes from the bus, in records of a SocketCAN frame each (16 bytes)."""

from __future__ import annotations

import functools
import socket
import struct
from itertools import cycle, islice
from typing import TYPE_CHECKING, Any

import can
from desk_bench import DRIVE, SCALE, DeskBench
from node_bench import NODE_ID, NodeBench

from hil_sim.runner.can_port import CanPort as SimulatorPort
from local_can import wire
from local_can.bus import LocalCanBus
from servo_ctrl.canopen.errors import SdoError
from servo_ctrl.canopen.plan import plan_machine
from servo_ctrl.canopen.stack import Network, SdoPort
from servo_ctrl.canopen.watch import HeartbeatWatch, emcy_handler
from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.cycle import Cycle
from servo_ctrl.daemon.sole_controller import report_others
from servo_ctrl.io.can_port import BusNews, CanPort
from tests.hostile.targets import ROOT, target

if TYPE_CHECKING:
    from collections.abc import Sequence

    from servo_ctrl.canopen.plan import NodePlan
    from servo_ctrl.config.model import MachineConfig

MOST_FRAMES = 400
MOST_REQUESTS = 2000
"""Of one transfer: an endless one would go on for ever."""
SDO_WORDS = tuple(
    bytes.fromhex(text) for text in ("40", "4f", "41", "60", "00", "20", "80", "a0", "c0", "c2", "c6")
)


def framed(*frames: tuple[int, bytes]) -> bytes:
    """Frames as they lie on the wire of localcan."""
    return b"".join(wire.FRAME.pack(can_id, len(data), 0, data) for can_id, data in frames)


def messages(data: bytes) -> list[can.Message]:
    """What python-can's interface makes of records, of any flags and lengths up to 64."""
    found = []
    for header, length, _, payload in wire.FRAME.iter_unpack(
        data[: len(data) // 16 * 16][: 16 * MOST_FRAMES]
    ):
        remote, fd = bool(header & wire.REMOTE), length > 8
        size = min(length, 64)
        found.append(
            can.Message(
                arbitration_id=header & wire.EXTENDED_ID_MASK if header & wire.EXTENDED else header & 0x7FF,
                is_extended_id=bool(header & wire.EXTENDED),
                is_remote_frame=remote and not fd,
                is_error_frame=bool(header & wire.ERROR),
                is_fd=fd,
                dlc=size,
                data=b"" if remote and not fd else (payload * 8)[:size],
            )
        )
    return found


class Waiting:
    """A python-can bus that has these messages and takes whatever is sent."""

    channel_info = "fuzz"

    def __init__(self, waiting: list[can.Message]) -> None:
        self._waiting = waiting[::-1]
        self.sent = 0

    def recv(self, _timeout: float) -> can.Message | None:
        return self._waiting.pop() if self._waiting else None

    def send(self, _message: can.Message, _timeout: float | None = None) -> None:
        self.sent += 1

    def __len__(self) -> int:
        return len(self._waiting)


@functools.cache
def machine() -> tuple[MachineConfig, tuple[NodePlan, ...]]:
    """The X-Y table and what boot knows of its nodes."""
    config = load_machine(ROOT / "machines" / "xy_table")
    return config, plan_machine(config)


class Core:
    """A machine that computes nothing."""

    def tick(self, _cycle: int, _elapsed: int, _inputs: Any) -> list[bytes]:
        return [bytes(7), bytes(7)]

    def input_missing(self, _node: int) -> bool:
        return False

    def input_twice(self, _node: int) -> None:
        pass

    def input_of_other_length(self, _node: int, _size: int) -> None:
        pass


@functools.cache
def _node() -> NodeBench:
    return NodeBench()


def own_node() -> NodeBench:
    """Our own node, as it is after a reset of its communication, and with nothing asked for."""
    bench = _node()
    bench.node.boot_up()
    bench.put(0x000, b"\x82\x00")
    bench.desk.__init__()  # type: ignore[misc]  # as it was made
    bench.frames.clear()
    return bench


def _traffic() -> Sequence[bytes]:
    inputs = [(0x181, bytes(8)), (0x18B, bytes(4)), (0x182, bytes(8)), (0x18C, bytes(4))]
    told = [
        (0x701, b"\x05"),
        (0x081, b"\x11\x86\x20\0\0\0\0\0"),
        (0x70B, b"\0"),
        (0x67F, b"\x40\0\x10\0\0\0\0\0"),
    ]
    foreign = [(0x80, b""), (0x201, bytes(7)), (0x77F, b"\x05"), (wire.ERROR | 0x04, b"\0\1\0\0\0\0\0\7")]
    return [framed(*inputs, *told), framed(*inputs, *foreign), framed((wire.EXTENDED | 0x181, bytes(8)))]


@target("servo_ctrl.io.can_port", _traffic, words=(b"\x81\1\0\0", b"\x08", b"\x40", b"\0\0\0\x20"))
def frames_to_the_controller(data: bytes) -> None:
    """Port, cyclic inputs, heartbeats, emergencies, other controllers, our own node; no axes behind."""
    config, plans = machine()
    bus = Waiting(messages(data))
    port = CanPort(bus, "fuzz")  # type: ignore[arg-type]  # the part of a bus that it uses
    told: list[str] = []
    bench = own_node()
    port.fallback = bench.network.notify
    watch = HeartbeatWatch(plans, 100, told.append)
    rpdos = [port.frame(plan.rpdo.cob_id, 7) for plan in plans if len(plan.pdos) > 1]
    cycle_ = Cycle(
        Core(),
        port.frame(0x80, 0),
        rpdos,
        [plan.tpdo.codec.layout for plan in plans],
        lockstep=False,
        on_begin=bench.node.count_cycles,
        on_end=lambda: None,
    )
    for place, plan in enumerate(plans):
        port.handlers[plan.tpdo.cob_id] = cycle_.handler(place)
        port.handlers[0x700 + plan.node_id] = watch.handler(place)
        port.handlers[0x080 + plan.node_id] = emcy_handler(plan, told.append)
    report_others(config, plans, port, told.append)
    port.on_error_frame = lambda news: told.append(_in_words(news))
    while len(bus):
        before = len(bus)
        cycle_.begin()
        told += watch.advance(cycle_.number)
        port._drain()
        assert len(bus) < before, "the port takes nothing any more"
    assert all(isinstance(text, str) and text and len(text) < 500 for text in told)


def _in_words(news: BusNews) -> str:
    assert news.text
    return news.text


def _sdo_requests() -> Sequence[bytes]:
    asked = [
        "4000100000000000",
        "2f00210001000000",
        "4012210000000000",
        "6000000000000000",
        "2104210104000000",
    ]
    asked += ["07ac0d0000000000", "a00010007f000000", "c204210104000000", "8000100000000405"]
    return [b"".join(bytes.fromhex(text) for text in asked)]


@target("servo_ctrl.canopen.sdo_server", _sdo_requests, words=SDO_WORDS)
def sdo_to_the_controller(data: bytes) -> None:
    bench = own_node()
    for start in range(0, min(len(data), 8 * MOST_FRAMES), 8):
        bench.frames.clear()
        bench.put(0x600 + NODE_ID, data[start : start + 8])
        assert len(bench.frames) <= 1
    assert bench.ask("40 0010 00 00000000") == ["4300100000000000"]


AND_ONE_MORE = b"\xff"
"""Begins an answer that another one follows unasked."""


def _sdo_answers() -> Sequence[bytes]:
    written = [
        "6041600000000000",
        "6041600000000000",
        "2000000000000000",
        "3000000000000000",
        "2000000000000000",
    ]
    expedited, segmented = "4b41600037120000", "4141600009000000"
    segments = ["0061626364656667", "1b68690000000000"]
    return [
        b"".join(bytes.fromhex(text) for text in (*read, *written))
        for read in ([expedited], [segmented, *segments])
    ]


@target(
    "servo_ctrl.canopen.stack", _sdo_answers, declared=SdoError, words=(*SDO_WORDS, b"\x41\x60\0"), short=150
)
def sdo_answers_of_a_node(data: bytes) -> None:
    """A node that answers by these frames over and over again, some of them unasked."""
    answers = [data[start : start + 8] for start in range(0, len(data), 8)] or [b""]
    script = islice(cycle(answers), MOST_REQUESTS)
    asked = 0

    def send(_can_id: int, request: bytes) -> None:
        nonlocal asked
        asked += request[0] != 0x80  # an abort of ours wants no answer
        assert asked < MOST_REQUESTS, "an endless transfer"
        for answer in script:
            network.notify(0x581, bytearray(answer), 0.0)
            if not answer.startswith(AND_ONE_MORE):
                break

    network = Network(send)
    port = SdoPort(network, 1, timeout_s=0.0, tries=3)
    try:
        assert isinstance(port.read(0x6041, 0), bytes)
        port.write(0x6041, 0, b"1234")
        port.write(0x6041, 0, b"longer than that")
    finally:
        port.close()


@functools.cache
def _simulator() -> DeskBench:
    return DeskBench()


def _to_simulator() -> Sequence[bytes]:
    sdo = [
        bytes.fromhex(text)
        for text in ("4041600000000000", "2b40600006000000", "a02110007f000000", "c2211000ff000000")
    ]
    frames = [
        (0, b"\1\0"),
        (0x80, b""),
        (0x600 + DRIVE, sdo[0]),
        (0x600 + DRIVE, sdo[1]),
        (0x600 + SCALE, sdo[0]),
    ]
    frames += [
        (0x600 + DRIVE, sdo[2]),
        (0x600 + DRIVE, b"\xa3".ljust(8, b"\0")),
        (0x600 + DRIVE, sdo[3]),
        (0x80, b""),
    ]
    return [
        framed(*frames),
        framed((0, b"\1\0"), (0x201, bytes(6)), (0x80, b""), (0x77F, b"\5"), (0, b"\x81\1")),
    ]


@target("hil_sim.node.sdo_server", _to_simulator, words=(*SDO_WORDS, b"\1\6\0\0", b"\x80\0\0\0\0"), short=100)
def frames_to_the_simulator(data: bytes) -> None:
    desk = _simulator()
    desk.frames.clear()
    desk.put(0, b"\x81\0")
    port = SimulatorPort(Waiting(messages(data)))  # type: ignore[arg-type]  # the part of a bus that it uses
    port.on_overrun = desk.bench.on_overrun
    port.drain(desk.put)
    desk.put(0, b"\x81\0")  # reset: whatever was done to it, it is itself again
    desk.frames.clear()
    for node in (DRIVE, SCALE):
        desk.put(0x600 + node, bytes.fromhex("4000100000000000"))
    answers = [(can_id, data[:4].hex()) for can_id, data in desk.frames]
    assert answers == [(0x580 + DRIVE, "43001000"), (0x580 + SCALE, "43001000")]


@target("local_can.bus", _traffic, declared=can.CanError, words=(b"\x09", b"\0\0\0\x20", b"\0\0\0\xe0"))
def packets_to_a_client(data: bytes) -> None:
    """A hub that is none: packets of any content."""
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


@target("local_can.wire", _traffic, words=(b"\0\0\0\x20", b"\0\0\0\x80"))
def frames_in_the_hub(data: bytes) -> None:
    """Rank and length in bits of every frame that the hub lets in."""
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
    """Whatever a client asks to hear: refused, or it decides on every frame, and stops no error frame."""
    filters = wire.unpack_filters(data)
    if filters is None:
        return
    assert len(filters) <= wire.MOST_FILTERS
    assert wire.pack_filters(filters) == data
    assert wire.passes(wire.ERROR | 0x004, filters)
    for can_id, mask in filters:
        header = can_id & (wire.EXTENDED | wire.EXTENDED_ID_MASK)
        assert wire.passes(header, filters) or (can_id ^ header) & mask
