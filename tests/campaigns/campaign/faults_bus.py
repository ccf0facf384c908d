"""Faults on the wire: frames that are lost, late, changed, or somebody else's; an interface that fails."""

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

    from tests.campaigns.campaign.wire import Passing

TPDO, RPDO, EMCY, HEARTBEAT = 0x180, 0x200, 0x080, 0x700
SHORT_GAP, LONG_GAP = (1, 15), (30, 60)
OWN_ID = 127
GAPS = (REALTIME,)
"""In lockstep one missing input is one too many."""


def dropping(context: FaultContext, wanted: Callable[[int], bool], cycles: int | None = None) -> None:
    """Frames of the nodes do not arrive, for so many cycles or for ever."""
    last = None if cycles is None else context.wire.cycle + cycles

    def inbound(can_id: int, data: bytes) -> Passing:
        if wanted(can_id) and (last is None or context.wire.cycle <= last):
            return []
        return [(can_id, data)]

    context.wire.inbound = inbound


def short_gap(context: FaultContext) -> None:
    """A node's inputs stay away for a few cycles."""
    dropping(context, lambda can_id: can_id == TPDO + context.node, context.rng.randint(*SHORT_GAP))


def inputs_lost(context: FaultContext) -> None:
    """A node's inputs stay away."""
    dropping(context, lambda can_id: can_id == TPDO + context.node)


def inputs_late(context: FaultContext) -> None:
    """A node's inputs come behind the next SYNC, for a while, and are those of the cycle before."""
    wire, own = context.wire, TPDO + context.node
    last = wire.cycle + context.rng.randint(1, 12)
    kept: list[bytes] = []

    def inbound(can_id: int, data: bytes) -> Passing:
        if can_id != own or (wire.cycle > last and not kept):
            return [(can_id, data)]
        arriving = [(own, each) for each in kept]
        kept.clear()
        if wire.cycle > last:
            return [*arriving, (can_id, data)]
        kept.append(data)
        return arriving

    wire.inbound = inbound


def heartbeat_lost(context: FaultContext) -> None:
    """A node's heartbeats stay away."""
    dropping(context, lambda can_id: can_id == HEARTBEAT + context.node)


def wrong_length(context: FaultContext) -> None:
    """A node's inputs are cut, or have bytes too many, from now on."""
    own, size = TPDO + context.node, context.rng.choice((0, 1, 3, 5, 7))

    def inbound(can_id: int, data: bytes) -> Passing:
        if can_id != own:
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
            context.wire.say(can_id, context.rng.randbytes(context.rng.randint(0, 8)))


def emergency(context: FaultContext) -> None:
    """A node sends an emergency message."""
    code = context.rng.choice((0x2310, 0x3220, 0x4210, 0x7320, 0x8130, 0xFF10))
    context.wire.say(EMCY + context.node, code.to_bytes(2, "little") + b"\x09" + bytes(5))


def second_controller(context: FaultContext) -> None:
    """Another controller: its SYNC, set points or heartbeats."""
    frames = ((0x080, b""), (RPDO + context.drive_id, bytes(6)), (HEARTBEAT + OWN_ID, b"\x05"))
    context.wire.say(*context.rng.choice(frames))


def duplicate_node(context: FaultContext) -> None:
    """Another node with the id of one of ours: its inputs, beside ours, from now on."""
    wire, own = context.wire, TPDO + context.node

    def inbound(can_id: int, data: bytes) -> Passing:
        if can_id != own:
            return [(can_id, data)]
        other = bytes(byte ^ 0x10 for byte in data)
        return [(can_id, data), (can_id, other)]

    wire.inbound = inbound


def overrun(context: FaultContext) -> None:
    """The interface has lost frames."""
    context.wire.error(0x004, bytes((0, context.rng.choice((1, 2)), 0, 0, 0, 0, 0, 0)))


def bus_off(context: FaultContext) -> None:
    """The interface is off the bus: it says so, and nothing passes any more."""
    context.wire.error(0x040, bytes(8))
    context.wire.outbound = lambda _can_id, _data: []
    dropping(context, lambda _can_id: True)


def interface_fails(context: FaultContext) -> None:
    """Sending and receiving raise from now on."""
    context.wire.failure = can.CanOperationError("the adapter was pulled out")
    context.wire.end.wake()


def bus_warning(context: FaultContext) -> None:
    """The interface counts errors."""
    context.wire.error(0x004, bytes((0, context.rng.choice((0x04, 0x08, 0x10, 0x20)), 0, 0, 0, 0, 0, 0)))


FAULTS = (
    Fault("inputs missing briefly", short_gap, pacings=GAPS, states=WIRED),
    Fault(
        "inputs missing",
        inputs_lost,
        "inputs missing",
        ("cyclic inputs do not come",),
        states=WIRED,
        blind_s=0.025,
        seen_cycles=24,
    ),
    Fault("inputs late", inputs_late, pacings=GAPS, states=WIRED),
    Fault(
        "heartbeat missing",
        heartbeat_lost,
        "heartbeat missing",
        ("no heartbeat",),
        states=WIRED,
        seen_cycles=105,
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
            distorts=True,
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
