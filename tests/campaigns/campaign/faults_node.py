"""Faults of the nodes and of the table: silence, restarts, drive faults, an axis that does not move."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tests.campaigns.campaign.fault_context import POWERED, WIRED, Fault, FaultContext
from tests.campaigns.campaign.faults_bus import EMCY, HEARTBEAT, TPDO

if TYPE_CHECKING:
    from tests.campaigns.campaign.wire import Passing

SDO_TO, SDO_FROM = 0x600, 0x580
WRITES = (
    (0x6085, 0, 4),
    (0x6065, 0, 4),
    (0x1017, 0, 2),
    (0x6072, 0, 2),
    (0x607D, 2, 4),
)
"""Objects that boot has written, and their bytes."""


def node_silent(context: FaultContext) -> None:
    """The node's cable is cut: it receives nothing, and nobody receives from it. Its own time goes on."""
    node, wire = context.node, context.wire
    its = {base + node for base in (EMCY, TPDO, TPDO + 0x100, SDO_FROM, HEARTBEAT)}
    slave = context.slave
    handle = wire.nodes

    def inbound(can_id: int, data: bytes) -> Passing:
        return [] if can_id in its else [(can_id, data)]

    def deaf(can_id: int, data: bytes) -> None:
        kept = slave.pdos.sample, slave.activate, slave.heartbeats.on_heartbeat
        slave.pdos.sample = slave.activate = _nothing
        slave.heartbeats.on_heartbeat = _not_heard
        if can_id not in {SDO_TO + node, 0x200 + node}:
            handle(can_id, data)
        slave.pdos.sample, slave.activate, slave.heartbeats.on_heartbeat = kept

    bench = context.stand.bench
    bench._tables_of_all = lambda: None  # type: ignore[method-assign]  # each node receives for itself
    bench._route()
    wire.inbound, wire.nodes = inbound, deaf


def node_restarts(context: FaultContext) -> None:
    """The node's supply dips: it boots again, without power and without its configuration."""

    def restart() -> None:
        context.slave.start()
        context.stand.bench._route()

    context.wire.then(restart)


def drive_fault(context: FaultContext) -> None:
    """The drive reports a fault and brakes by itself."""
    code = context.rng.choice((0x2310, 0x3210, 0x4210, 0x5000, 0x7320))
    context.wire.then(lambda: context.drive.fault(code, 0x09))


def simulator_killed(context: FaultContext) -> None:
    """No node is there any more."""
    context.wire.nodes_dead = True


def object_changed(context: FaultContext) -> None:
    """Somebody else writes to a drive by SDO what boot had written."""
    index, subindex, size = context.rng.choice(WRITES)
    value = context.rng.randrange(1, 1 << (8 * size - 2))
    head = bytes((0x23 | (4 - size) << 2, index & 0xFF, index >> 8, subindex))
    context.wire.say(SDO_TO + context.drive_id, head + value.to_bytes(4, "little"))


def _nothing() -> None:
    """It does not hear the SYNC."""


def _not_heard(_node: int) -> None:
    """It does not hear the heartbeat."""


FAULTS = (
    Fault(
        "node silent while booting",
        node_silent,
        words=("its cyclic inputs do not come",),  # of a node that had been asked all by then
        states=("booting",),
        sdo_timeout_s=0.2,
        blind_s=0.09,
        may_stop=True,
        seen_cycles=25,
    ),
    Fault("simulator killed while booting", simulator_killed, states=("booting",), sdo_timeout_s=0.1),
    Fault(
        "node silent",
        node_silent,
        "inputs missing",
        ("cyclic inputs do not come",),
        states=WIRED,
        blind_s=0.09,
        physical=True,
        distorts=True,
        seen_cycles=24,
    ),
    Fault(
        "node restarts",
        node_restarts,
        "heartbeat missing",
        ("has restarted",),
        states=WIRED,
        physical=True,
        coasts=True,
        also=("drive fault", "inputs missing", "following error"),
    ),
    Fault("drive fault", drive_fault, "emergency message", ("EMCY",), states=POWERED, physical=True),
    Fault(
        "simulator killed",
        simulator_killed,
        "inputs missing",
        ("cyclic inputs do not come",),
        states=WIRED,
        kills="nodes",
        seen_cycles=24,
    ),
    Fault(
        "object of a node changed",
        object_changed,
        "object of a node changed",
        ("somebody else writes",),
        states=WIRED,
    ),
)
