"""Faults of the nodes: silence, restarts, drive faults, changed objects."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tests.campaigns.campaign.fault_context import POWERED, WIRED, Fault, FaultContext
from tests.campaigns.campaign.faults_bus import EMCY, HEARTBEAT, TPDO

if TYPE_CHECKING:
    from tests.campaigns.campaign.wire import Arriving

SDO_TO, SDO_FROM = 0x600, 0x580
WRITES = ((0x6085, 0, 4), (0x6065, 0, 4), (0x1017, 0, 2), (0x6072, 0, 2), (0x607D, 2, 4))
"""Index, subindex and size in bytes of objects that boot has written."""


def node_silent(context: FaultContext) -> None:
    """The cable of a node is cut: it neither receives nor sends, and its own timers continue."""
    node, wire = context.node, context.wire
    node_cob_ids = {base + node for base in (EMCY, TPDO, TPDO + 0x100, SDO_FROM, HEARTBEAT)}
    slave = context.slave
    deliver = wire.nodes

    def inbound(can_id: int, data: bytes) -> Arriving:
        return [] if can_id in node_cob_ids else [(can_id, data)]

    def deliver_to_others(can_id: int, data: bytes) -> None:
        node_handlers = slave.pdos.sample, slave.activate, slave.heartbeats.on_heartbeat
        slave.pdos.sample = slave.activate = _ignore_sync
        slave.heartbeats.on_heartbeat = _ignore_heartbeat
        if can_id not in {SDO_TO + node, 0x200 + node}:
            deliver(can_id, data)
        slave.pdos.sample, slave.activate, slave.heartbeats.on_heartbeat = node_handlers

    bench = context.stand.bench
    bench._tables_of_all = lambda: None  # type: ignore[method-assign]  # each node receives for itself
    bench._update_routes()
    wire.inbound, wire.nodes = inbound, deliver_to_others


def node_restarts(context: FaultContext) -> None:
    """The supply of a node dips: it restarts without drive power and without its configuration."""

    def restart() -> None:
        context.slave.start()
        context.stand.bench._update_routes()

    context.wire.after_frame(restart)


def drive_fault(context: FaultContext) -> None:
    """The drive reports a fault and brakes by itself."""
    code = context.rng.choice((0x2310, 0x3210, 0x4210, 0x5000, 0x7320))
    context.wire.after_frame(lambda: context.drive.fault(code, 0x09))


def simulator_killed(context: FaultContext) -> None:
    """All nodes disappear."""
    context.wire.nodes_dead = True


def object_changed(context: FaultContext) -> None:
    """Another client writes by SDO to an object of a drive that boot has written."""
    index, subindex, size = context.rng.choice(WRITES)
    value = context.rng.randrange(1, 1 << (8 * size - 2))
    head = bytes((0x23 | (4 - size) << 2, index & 0xFF, index >> 8, subindex))
    context.wire.send_foreign(SDO_TO + context.drive_id, head + value.to_bytes(4, "little"))


def _ignore_sync() -> None:
    """Ignore the SYNC."""


def _ignore_heartbeat(_node: int) -> None:
    """Ignore a heartbeat."""


FAULTS = (
    Fault(
        "node silent while booting",
        node_silent,
        words=("its TPDOs are no longer received",),  # of a node whose boot was complete by then
        states=("booting",),
        sdo_timeout_s=0.2,
        blind_s=0.09,
        may_stop=True,
        reported_within_cycles=25,
    ),
    Fault("simulator killed while booting", simulator_killed, states=("booting",), sdo_timeout_s=0.1),
    Fault(
        "node silent",
        node_silent,
        "inputs missing",
        ("TPDOs are no longer received",),
        states=WIRED,
        blind_s=0.09,
        physical=True,
        changes_frames=True,
        reported_within_cycles=24,
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
        ("TPDOs are no longer received",),
        states=WIRED,
        kills="nodes",
        reported_within_cycles=24,
    ),
    Fault(
        "object of a node changed",
        object_changed,
        "object of a node changed",
        ("another participant writes",),
        states=WIRED,
    ),
)
