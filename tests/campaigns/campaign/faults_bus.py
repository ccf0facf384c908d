"""Faults of the transmission: frames that are lost, late, changed or foreign; an interface that fails."""

from __future__ import annotations

from typing import TYPE_CHECKING

import can

from tests.campaigns.campaign.fault_context import (
    LOCKSTEP,
    NODES,
    POWERED,
    REALTIME,
    WIRED,
    Fault,
    FaultContext,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.campaigns.campaign.wire import Arriving

TPDO, RPDO, EMCY, HEARTBEAT = 0x180, 0x200, 0x080, 0x700
SHORT_GAP, LONG_GAP = (1, 15), (30, 60)
OWN_ID = 127
REALTIME_ONLY = (REALTIME,)
"""Pacing of gaps that are tolerated: in lockstep no input may be missing."""


def drop_frames(context: FaultContext, is_dropped: Callable[[int], bool], cycles: int | None = None) -> None:
    """Drop frames of the nodes for a number of cycles; None = for ever."""
    last_cycle = None if cycles is None else context.wire.cycle + cycles

    def inbound(can_id: int, data: bytes) -> Arriving:
        if is_dropped(can_id) and (last_cycle is None or context.wire.cycle <= last_cycle):
            return []
        return [(can_id, data)]

    context.wire.inbound = inbound


def short_gap(context: FaultContext) -> None:
    """The inputs of a node are missing for a few cycles."""
    drop_frames(context, lambda can_id: can_id == TPDO + context.node, context.rng.randint(*SHORT_GAP))


def inputs_lost(context: FaultContext) -> None:
    """The inputs of a node are missing."""
    drop_frames(context, lambda can_id: can_id == TPDO + context.node)


def inputs_late(context: FaultContext) -> None:
    """The inputs of a node arrive one cycle late, after the next SYNC, for a while."""
    wire, tpdo_id = context.wire, TPDO + context.node
    last_cycle = wire.cycle + context.rng.randint(1, 12)
    delayed: list[bytes] = []

    def inbound(can_id: int, data: bytes) -> Arriving:
        if can_id != tpdo_id or (wire.cycle > last_cycle and not delayed):
            return [(can_id, data)]
        arriving = [(tpdo_id, each) for each in delayed]
        delayed.clear()
        if wire.cycle > last_cycle:
            return [*arriving, (can_id, data)]
        delayed.append(data)
        return arriving

    wire.inbound = inbound


def heartbeat_lost(context: FaultContext) -> None:
    """The heartbeats of a node are missing."""
    drop_frames(context, lambda can_id: can_id == HEARTBEAT + context.node)


def wrong_length(context: FaultContext) -> None:
    """The inputs of a node are too short or too long from now on."""
    tpdo_id, size = TPDO + context.node, context.rng.choice((0, 1, 3, 5, 7))

    def inbound(can_id: int, data: bytes) -> Arriving:
        if can_id != tpdo_id:
            return [(can_id, data)]
        return [(can_id, (data + bytes(8))[: size if size != len(data) else 2])]

    context.wire.inbound = inbound


def foreign_frames(context: FaultContext) -> None:
    """Frames of nodes that are not ours, of any length."""
    ours = {
        HEARTBEAT + OWN_ID,
        0x000,
        0x080,
        *(base + node for base in range(0, 0x780, 0x80) for node in NODES),
    }
    for _ in range(context.rng.randint(1, 60)):
        can_id = context.rng.randrange(1, 0x800)
        if can_id not in ours and can_id & 0x7F not in {*NODES, OWN_ID, 0}:
            context.wire.send_foreign(can_id, context.rng.randbytes(context.rng.randint(0, 8)))


def emergency(context: FaultContext) -> None:
    """A node sends an emergency message."""
    code = context.rng.choice((0x2310, 0x3220, 0x4210, 0x7320, 0x8130, 0xFF10))
    context.wire.send_foreign(EMCY + context.node, code.to_bytes(2, "little") + b"\x09" + bytes(5))


def second_controller(context: FaultContext) -> None:
    """Another controller: its SYNC, set points or heartbeats."""
    frames = ((0x080, b""), (RPDO + context.drive_id, bytes(6)), (HEARTBEAT + OWN_ID, b"\x05"))
    context.wire.send_foreign(*context.rng.choice(frames))


def duplicate_node(context: FaultContext) -> None:
    """Another node with the id of one of ours also sends inputs from now on."""
    wire, tpdo_id = context.wire, TPDO + context.node

    def inbound(can_id: int, data: bytes) -> Arriving:
        if can_id != tpdo_id:
            return [(can_id, data)]
        other = bytes(byte ^ 0x10 for byte in data)
        return [(can_id, data), (can_id, other)]

    wire.inbound = inbound


def overrun(context: FaultContext) -> None:
    """The interface has lost frames."""
    context.wire.error(0x004, bytes((0, context.rng.choice((1, 2)), 0, 0, 0, 0, 0, 0)))


def bus_off(context: FaultContext) -> None:
    """The interface reports that it is off the bus, and transmits nothing from now on."""
    context.wire.error(0x040, bytes(8))
    context.wire.outbound = lambda _can_id, _data: []
    drop_frames(context, lambda _can_id: True)


def interface_fails(context: FaultContext) -> None:
    """Sending and receiving raise from now on."""
    context.wire.failure = can.CanOperationError("the adapter was pulled out")
    context.wire.controller_port.wake()


def bus_warning(context: FaultContext) -> None:
    """The interface counts errors."""
    context.wire.error(0x004, bytes((0, context.rng.choice((0x04, 0x08, 0x10, 0x20)), 0, 0, 0, 0, 0, 0)))


FAULTS = (
    Fault("inputs missing briefly", short_gap, pacings=REALTIME_ONLY, states=WIRED),
    Fault(
        "inputs missing",
        inputs_lost,
        "inputs missing",
        ("TPDOs are no longer received",),
        states=WIRED,
        blind_s=0.025,
        reported_within_cycles=24,
    ),
    Fault("inputs late", inputs_late, pacings=REALTIME_ONLY, states=WIRED),
    Fault(
        "heartbeat missing",
        heartbeat_lost,
        "heartbeat missing",
        ("no heartbeat",),
        states=WIRED,
        reported_within_cycles=105,
    ),
    Fault("PDO of another length", wrong_length, "PDO of another length", ("bytes",), states=WIRED),
    Fault("foreign frames", foreign_frames),
    Fault("emergency message", emergency, "emergency message", ("EMCY",), states=WIRED),
    Fault("another controller", second_controller, "another controller", ("another controller",)),
    Fault(
        "duplicate node", duplicate_node, "duplicate node", ("twice", "two nodes", "same node"), states=WIRED
    ),
    Fault("frames lost on the bus", overrun, "frames lost on the bus", ("overrun",), states=WIRED),
    *(
        Fault(
            name,
            bus_off,
            event,
            ("bus-off",),
            pacings=(pacing,),
            states=(*POWERED, "standby"),
            blind_s=0.08,
            changes_frames=True,
        )
        for name, event, pacing in (
            ("bus-off", "bus off", REALTIME),
            ("bus-off in lockstep", "bus down", LOCKSTEP),
        )
    ),
    Fault("interface fails", interface_fails, "bus down", ("failed",), states=WIRED, blind_s=0.08),
    Fault("interface fails while booting", interface_fails, states=("booting",), sdo_timeout_s=0.1),
    Fault("bus warning", bus_warning, None, ("error passive", "error warning"), states=WIRED),
)
