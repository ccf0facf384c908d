"""Fuzz targets: frames from the bus to the simulator."""

import functools
from collections.abc import Sequence

from in_process_nodes import DRIVE, SCALE, InProcessNodes

from hil_sim.runner.can_port import CanPort as SimulatorPort
from tests.campaigns.hostile.bus_records import SDO_WORDS, ScriptedBus, framed, messages
from tests.campaigns.hostile.targets import target


@functools.cache
def _simulator() -> InProcessNodes:
    return InProcessNodes()


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
    nodes = _simulator()
    nodes.frames.clear()
    nodes.put(0, b"\x81\0")
    port = SimulatorPort(ScriptedBus(messages(data)))  # type: ignore[arg-type]  # the part of a bus that it uses
    port.on_overrun = nodes.bench.on_overrun
    port.drain(nodes.put)
    nodes.put(0, b"\x81\0")  # reset: whatever was done to it, it is itself again
    nodes.frames.clear()
    for node in (DRIVE, SCALE):
        nodes.put(0x600 + node, bytes.fromhex("4000100000000000"))
    answers = [(can_id, data[:4].hex()) for can_id, data in nodes.frames]
    assert answers == [(0x580 + DRIVE, "43001000"), (0x580 + SCALE, "43001000")]
