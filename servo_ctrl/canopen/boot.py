"""Boot of the nodes: identity, scaling, PDOs and limits are checked and configured by SDO.

Blocking SDO transfers run in worker threads, one per node, and every wait is bounded. All nodes are tried,
and all failures are reported together, each with a remedy.
"""

import asyncio
import contextlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain

from servo_ctrl.canopen.drive_units import ADDRESSES
from servo_ctrl.canopen.errors import BootError, NodeError, SdoError
from servo_ctrl.canopen.nmt import NmtCommand, NmtState, command_nodes
from servo_ctrl.canopen.node_plan import NodePlan, PdoPlan, Write
from servo_ctrl.canopen.pdo import COB_ID_INVALID
from servo_ctrl.canopen.stack import SDO_TIMEOUT_S, Network, SdoPort

PRESENCE_TRIES = 10
"""SDO tries before a node counts as absent; chosen: 3 s, because a node may just have been switched on."""
IDENTITY = {
    (0x1000, 0): "device type",
    (0x1018, 1): "vendor-ID",
    (0x1018, 2): "product code",
    (0x1018, 3): "revision number",
}


async def boot_nodes(
    network: Network,
    plans: Sequence[NodePlan],
    timeout_s: float = SDO_TIMEOUT_S,
    *,
    in_thread: Callable[[], None] = lambda: None,
    tries: int = PRESENCE_TRIES,
) -> None:
    """Check and configure every node; they are pre-operational afterwards.

    `timeout_s` bounds the wait for each SDO response (wall clock). `in_thread` is called first in the thread
    of each node. A node counts as absent after `tries` requests.
    Raises BootError with all nodes that cannot be used.
    """
    command_nodes(network, plans, NmtCommand.ENTER_PRE_OPERATIONAL)

    def boot_one(plan: NodePlan) -> None:
        in_thread()
        _boot_node(network, plan, restarted, timeout_s, tries)

    with _boot_ups(network, plans) as restarted:
        outcomes = await asyncio.gather(
            *(asyncio.to_thread(boot_one, plan) for plan in plans), return_exceptions=True
        )
    failures = []
    for plan, outcome in zip(plans, outcomes, strict=True):
        if isinstance(outcome, NodeError):
            failures.append(outcome)
        elif isinstance(outcome, BaseException):
            raise outcome
        elif plan.node_id in restarted:
            failures.append(NodeError(plan.name, "restarted while it was configured; check its supply"))
    if failures:
        raise BootError(failures)


@contextlib.contextmanager
def _boot_ups(network: Network, plans: Sequence[NodePlan]) -> Iterator[set[int]]:
    """Collect the ids of the nodes that send a boot-up message inside the block."""
    booted: set[int] = set()

    def on_heartbeat(can_id: int, payload: bytes | bytearray, _timestamp_s: float) -> None:
        if payload and payload[0] & 0x7F == NmtState.INITIALISING:
            booted.add(can_id - 0x700)

    for plan in plans:
        network.subscribe(0x700 + plan.node_id, on_heartbeat)
    try:
        yield booted
    finally:
        for plan in plans:
            network.unsubscribe(0x700 + plan.node_id, on_heartbeat)


def _boot_node(
    network: Network, plan: NodePlan, restarted: set[int], timeout_s: float, tries: int = PRESENCE_TRIES
) -> None:
    """Check and configure one node, blocking (for a worker thread). Raises NodeError."""
    timeout_s = plan.sdo_timeout_s or timeout_s
    with contextlib.closing(SdoPort(network, plan.node_id, timeout_s=timeout_s, tries=tries)) as sdo:
        _check_presence(sdo, plan, tries)
    restarted.discard(plan.node_id)  # it may have just been switched on; a later restart is an error
    with contextlib.closing(SdoPort(network, plan.node_id, timeout_s=timeout_s)) as sdo:
        _check_identity(sdo, plan)
        _write(sdo, plan, _concise_dcf_writes(plan))  # before the check of the units, which it may set
        _check_expectations(sdo, plan)
        _check_units(sdo, plan)
        for pdo in plan.pdos:
            if pdo.fixed:
                _check_mapping(sdo, plan, pdo)
        _write(sdo, plan, chain(_unused_pdo_writes(plan), *map(_pdo_writes, plan.pdos), plan.writes))


def _write(sdo: SdoPort, plan: NodePlan, writes: Iterable[Write]) -> None:
    """Write in this order. Raises NodeError for the first entry that the node refuses."""
    for write in writes:
        try:
            sdo.write(write.index, write.subindex, write.data)
        except SdoError as error:
            text = f"{write.description}: {error}; see {plan.key} in the machine file"
            raise NodeError(plan.name, text) from None


def _check_presence(sdo: SdoPort, plan: NodePlan, tries: int) -> None:
    try:
        sdo.read(0x1000, 0)
    except SdoError as error:
        text = f"{error}; it is not a CANopen device"
        if error.abort_code is None:
            text = f"absent, no answer from 1000h in {tries} tries; check power, cable, bit rate and node id"
        raise NodeError(plan.name, text) from None


def _check_identity(sdo: SdoPort, plan: NodePlan) -> None:
    for (index, subindex), name in IDENTITY.items():
        expected_value = plan.eds.default(index, subindex)
        if expected_value is None or (index == 0x1018 and expected_value == 0):
            continue  # the EDS does not fix this value
        value = _read(sdo, plan, index, subindex)
        if value != expected_value:
            raise NodeError(
                plan.name,
                f"a foreign node: {index:04X}h:{subindex:02X} ({name}) is 0x{value:08X}, "
                f"{plan.eds.path} says 0x{expected_value:08X}; check the node id and {plan.key}.eds",
            )


def _check_expectations(sdo: SdoPort, plan: NodePlan) -> None:
    for expected in plan.expectations:
        value = _read(sdo, plan, expected.index, expected.subindex)
        if value & expected.mask != expected.value:
            raise NodeError(
                plan.name,
                f"{expected.index:04X}h:{expected.subindex:02X} is {value}, the machine file says "
                f"{expected.value} ({expected.key}); correct the one that is wrong",
            )


def _check_units(sdo: SdoPort, plan: NodePlan) -> None:
    """Compare the units of the drive with the machine file. Raises NodeError."""
    if plan.units is None:
        return
    present = [
        address for address in ADDRESSES if address in plan.eds and address[0] not in plan.excluded_objects
    ]
    values = {address: _read(sdo, plan, *address) for address in present}
    if objections := "; ".join(plan.units.objections(values)):
        raise NodeError(plan.name, objections)


def _check_mapping(sdo: SdoPort, plan: NodePlan, pdo: PdoPlan) -> None:
    """Raise NodeError unless a fixed mapping is the one of the machine file."""
    count = _read(sdo, plan, pdo.mapping, 0)
    mapped_entries = [_read(sdo, plan, pdo.mapping, entry) for entry in range(1, count + 1)]
    expected_entries = [mapped.mapping_entry for mapped in pdo.codec.objects]
    if mapped_entries != expected_entries:
        shown = ", ".join(f"{entry:08X}h" for entry in mapped_entries)
        text = f"{pdo.name} maps {shown} and cannot be changed; the machine file says otherwise ({plan.key})"
        raise NodeError(plan.name, text)


def _concise_dcf_writes(plan: NodePlan) -> Iterator[Write]:
    for entry in plan.concise_dcf:
        yield Write(entry.index, entry.subindex, entry.data, "concise DCF")


def _unused_pdo_writes(plan: NodePlan) -> Iterator[Write]:
    for index, cob_id in plan.unused_pdos:
        yield Write(index, 1, _u32(cob_id | COB_ID_INVALID), "unused PDO off")


def _pdo_writes(pdo: PdoPlan) -> Iterator[Write]:
    """Yield the sequence of CiA 301 for a new mapping: PDO off, count 0, entries, count, PDO on."""
    objects = pdo.codec.objects
    yield Write(pdo.communication, 1, _u32(pdo.cob_id | COB_ID_INVALID), "PDO off")
    yield Write(pdo.communication, 2, bytes((pdo.transmission_type,)), "transmission type")
    if not pdo.received and not pdo.cyclic:
        if pdo.inhibit_ms:
            units = round(10.0 * pdo.inhibit_ms)  # of 100 us
            yield Write(pdo.communication, 3, units.to_bytes(2, "little"), "inhibit time")
        if pdo.event_timer_ms:
            yield Write(pdo.communication, 5, pdo.event_timer_ms.to_bytes(2, "little"), "event timer")
    if not pdo.fixed:
        yield Write(pdo.mapping, 0, b"\x00", "empty mapping")
        for entry, mapped in enumerate(objects, start=1):
            yield Write(pdo.mapping, entry, _u32(mapped.mapping_entry), f"map {mapped.name}")
        names = ", ".join(mapped.name for mapped in objects)
        yield Write(pdo.mapping, 0, bytes((len(objects),)), f"mapping of {names}")
    yield Write(pdo.communication, 1, _u32(pdo.cob_id), "PDO on")


def _u32(value: int) -> bytes:
    return value.to_bytes(4, "little")


def _read(sdo: SdoPort, plan: NodePlan, index: int, subindex: int) -> int:
    try:
        return int.from_bytes(sdo.read(index, subindex), "little")
    except SdoError as error:
        raise NodeError(plan.name, str(error)) from None
