"""Fuzz targets: frames from the bus to the controller."""

import functools
from collections.abc import Sequence
from itertools import cycle, islice
from typing import Any

from controller_node_bench import NODE_ID, ControllerNodeBench

from servo_ctrl.canopen.errors import SdoError
from servo_ctrl.canopen.node_plan import NodePlan
from servo_ctrl.canopen.plan import plan_machine
from servo_ctrl.canopen.stack import Network, SdoPort
from servo_ctrl.canopen.watch import HeartbeatWatch, emcy_handler
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.cycle.cycle import Cycle
from servo_ctrl.daemon.run.foreign_frames import report_masters
from servo_ctrl.io.can_port import CanPort
from servo_ctrl.io.error_frames import BusNews
from tests.campaigns.hostile.bus_records import MOST_FRAMES, SDO_WORDS, ScriptedBus, messages, traffic
from tests.campaigns.hostile.targets import ROOT, target

MOST_REQUESTS = 2000
"""Bounds the requests of one transfer, which may be endless."""


@functools.cache
def machine() -> tuple[MachineConfig, tuple[NodePlan, ...]]:
    """Return the X-Y table and the boot plan of its nodes."""
    config = load_machine(ROOT / "machines" / "xy_table")
    return config, plan_machine(config)


class Core:
    """A machine without computation."""

    def tick(self, _cycle: int, _elapsed: int, _inputs: Any) -> list[bytes]:
        return [bytes(7), bytes(7)]

    def input_missing(self, _node: int) -> bool:
        return False

    def duplicate_input(self, _node: int) -> None:
        pass

    def wrong_input_length(self, _node: int, _size: int) -> None:
        pass


@functools.cache
def _node() -> ControllerNodeBench:
    return ControllerNodeBench()


def own_node() -> ControllerNodeBench:
    """Send the frames to the controller's node after boot-up, without a request of its own."""
    bench = _node()
    bench.node.boot_up()
    bench.put(0x000, b"\x82\x00")
    bench.handler.__init__()  # type: ignore[misc]  # as it was made
    bench.frames.clear()
    return bench


@target("servo_ctrl.io.can_port", traffic, words=(b"\x81\1\0\0", b"\x08", b"\x40", b"\0\0\0\x20"))
def frames_to_the_controller(data: bytes) -> None:
    """Send the frames to port, cyclic inputs, supervision and the controller's node, without axes."""
    config, plans = machine()
    bus = ScriptedBus(messages(data))
    port = CanPort(bus, "fuzz")  # type: ignore[arg-type]  # the part of a bus that it uses
    reports: list[str] = []
    bench = own_node()
    port.fallback = bench.network.notify
    watch = HeartbeatWatch(plans, 100, reports.append)
    rpdos = [port.frame(plan.rpdo.cob_id) for plan in plans if len(plan.pdos) > 1]
    cycle_ = Cycle(
        Core(),
        port.frame(0x80),
        rpdos,
        [plan.tpdo.codec.size for plan in plans],
        port.flush,
        port.read_arrived,
        lockstep=False,
        on_begin=bench.node.count_cycles,
        on_end=lambda: None,
    )
    for place, plan in enumerate(plans):
        port.handlers[plan.tpdo.cob_id] = cycle_.handler(place)
        port.handlers[0x700 + plan.node_id] = watch.handler(place)
        port.handlers[0x080 + plan.node_id] = emcy_handler(plan, reports.append)
    report_masters(config, plans, port, reports.append)
    port.on_error_frame = lambda news: reports.append(_in_words(news))
    while len(bus):
        before = len(bus)
        cycle_.begin()
        reports += watch.advance(cycle_.number)
        port._drain()
        assert len(bus) < before, "the port takes nothing any more"
    assert all(isinstance(text, str) and text and len(text) < 500 for text in reports)


def _in_words(news: BusNews) -> str:
    assert news.text
    return news.text


def _sdo_requests() -> Sequence[bytes]:
    requests = [
        "4000100000000000",
        "2f00210001000000",
        "4012210000000000",
        "6000000000000000",
        "2104210104000000",
    ]
    requests += ["07ac0d0000000000", "a00010007f000000", "c204210104000000", "8000100000000405"]
    return [b"".join(bytes.fromhex(text) for text in requests)]


@target("servo_ctrl.canopen.sdo_server", _sdo_requests, words=SDO_WORDS)
def sdo_to_the_controller(data: bytes) -> None:
    bench = own_node()
    for start in range(0, min(len(data), 8 * MOST_FRAMES), 8):
        bench.frames.clear()
        bench.put(0x600 + NODE_ID, data[start : start + 8])
        assert len(bench.frames) <= 127  # a block at most
    bench.ask("8000000000000000")  # a block download that was begun would take the request for a segment
    assert bench.ask("40 0010 00 00000000") == ["4300100000000000"]


AND_ONE_MORE = b"\xff"
"""First byte of an answer that another one follows without a request."""


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
    """Read from a node that repeats these answers, some of them without a request."""
    answers = [data[start : start + 8] for start in range(0, len(data), 8)] or [b""]
    script = islice(cycle(answers), MOST_REQUESTS)
    count = 0

    def send(_can_id: int, request: bytes) -> None:
        nonlocal count
        count += request[0] != 0x80  # an abort of ours wants no answer
        assert count < MOST_REQUESTS, "an endless transfer"
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
