"""From an unknown bus to configured nodes: identity, scaling, PDOs, limits, then NMT start.

Blocking SDO in worker threads, one a node, every wait bounded. All nodes are tried, and all that fail are
reported together, each with what to do about it.
"""

import asyncio
import contextlib
from collections.abc import Iterable, Iterator, Sequence

from servo_ctrl.canopen.errors import BootError, NodeError, SdoError
from servo_ctrl.canopen.plan import NodePlan, PdoPlan
from servo_ctrl.canopen.stack import SDO_TIMEOUT_S, SDO_TRIES, Network, SdoPort
from servo_ctrl.canopen.watch import NMT_BOOT_UP

NMT_START = 0x01
NMT_STOP = 0x02
NMT_ENTER_PRE_OPERATIONAL = 0x80
COB_ID_INVALID = 1 << 31
PRESENCE_TRIES = 10
"""SDO tries before a node counts as absent: time enough for one that has just been switched on."""
IDENTITY: tuple[tuple[int, int, str], ...] = (
    (0x1000, 0, "device type"),
    (0x1018, 1, "vendor-ID"),
    (0x1018, 2, "product code"),
    (0x1018, 3, "revision number"),
)


async def boot_nodes(network: Network, plans: Sequence[NodePlan], timeout_s: float = SDO_TIMEOUT_S) -> None:
    """Check and configure every node; they are pre-operational afterwards.

    `timeout_s` bounds each SDO answer (wall clock). Raises BootError with all nodes that cannot be used.
    """
    command_nodes(network, plans, NMT_ENTER_PRE_OPERATIONAL)
    with _boot_ups(network, plans) as restarted:
        outcomes = await asyncio.gather(
            *(asyncio.to_thread(_boot_node, network, plan, restarted, timeout_s) for plan in plans),
            return_exceptions=True,
        )
    failures = []
    for plan, outcome in zip(plans, outcomes, strict=True):
        if isinstance(outcome, NodeError):
            failures.append(outcome)
        elif isinstance(outcome, BaseException):
            raise outcome
        elif plan.node_id in restarted:
            failures.append(NodeError(_who(plan), "restarted while it was configured; check its supply"))
    if failures:
        raise BootError(failures)


def command_nodes(network: Network, plans: Iterable[NodePlan], command: int) -> None:
    """Send one NMT command to each of our nodes; other nodes on the bus are not ours to command."""
    for plan in plans:
        network.send_message(0x000, bytes((command, plan.node_id)))


@contextlib.contextmanager
def _boot_ups(network: Network, plans: Sequence[NodePlan]) -> Iterator[set[int]]:
    """The ids of nodes that send a boot-up message, as they do."""
    heard: set[int] = set()

    def on_heartbeat(can_id: int, payload: bytes | bytearray, _timestamp_s: float) -> None:
        if payload and payload[0] & 0x7F == NMT_BOOT_UP:
            heard.add(can_id - 0x700)

    for plan in plans:
        network.subscribe(0x700 + plan.node_id, on_heartbeat)
    try:
        yield heard
    finally:
        for plan in plans:
            network.unsubscribe(0x700 + plan.node_id, on_heartbeat)


def _boot_node(network: Network, plan: NodePlan, restarted: set[int], timeout_s: float) -> None:
    """Check and configure one node, blocking (for a worker thread). Raises NodeError."""
    _present(network, plan, timeout_s)
    restarted.discard(plan.node_id)  # it may have been switched on just now; from here on it may not
    sdo = SdoPort(network, plan.node_id, timeout_s=timeout_s, tries=SDO_TRIES)
    try:
        _check_identity(sdo, plan)
        _check_expectations(sdo, plan)
        for index, cob_id in plan.unused_pdos:
            _write(
                sdo,
                plan,
                index,
                1,
                (cob_id | COB_ID_INVALID).to_bytes(4, "little"),
                "unused PDO off",
            )
        for pdo in plan.pdos:
            _configure_pdo(sdo, plan, pdo)
        for write in plan.writes:
            _write(sdo, plan, write.index, write.subindex, write.data, write.what)
    finally:
        sdo.close()


def _present(network: Network, plan: NodePlan, timeout_s: float) -> None:
    sdo = SdoPort(network, plan.node_id, timeout_s=timeout_s, tries=PRESENCE_TRIES)
    try:
        sdo.read(0x1000, 0)
    except SdoError as error:
        if error.abort_code is None:
            raise NodeError(
                _who(plan),
                f"absent, no answer from 1000h in {PRESENCE_TRIES} tries; "
                "check power, cable, bit rate and node id",
            ) from None
        raise NodeError(_who(plan), f"{error}; it is no CANopen device") from None
    finally:
        sdo.close()


def _check_identity(sdo: SdoPort, plan: NodePlan) -> None:
    for index, subindex, name in IDENTITY:
        stated = plan.eds.default(index, subindex)
        if stated is None or (index == 0x1018 and stated == 0):
            continue  # the EDS leaves it open
        found = _read(sdo, plan, index, subindex)
        if found != stated:
            raise NodeError(
                _who(plan),
                f"a foreign node: {index:04X}h:{subindex:02X} ({name}) is 0x{found:08X}, "
                f"{plan.eds.path} says 0x{stated:08X}; check the node id and {plan.key}.eds",
            )


def _check_expectations(sdo: SdoPort, plan: NodePlan) -> None:
    for wanted in plan.expectations:
        found = _read(sdo, plan, wanted.index, wanted.subindex)
        good = found & wanted.mask == wanted.mask if wanted.mask is not None else found == wanted.value
        if not good:
            raise NodeError(
                _who(plan),
                f"{wanted.index:04X}h:{wanted.subindex:02X} is {found}, the machine file says "
                f"{wanted.value} ({wanted.key}); correct the one that is wrong",
            )


def _configure_pdo(sdo: SdoPort, plan: NodePlan, pdo: PdoPlan) -> None:
    """The standard remap sequence: switch off, empty, map, count, type, switch on."""
    names = ", ".join(mapped.name for mapped in pdo.codec.objects)
    _write(sdo, plan, pdo.communication, 1, (pdo.cob_id | COB_ID_INVALID).to_bytes(4, "little"), "PDO off")
    _write(sdo, plan, pdo.communication, 2, bytes((pdo.transmission_type,)), "transmission type")
    _write(sdo, plan, pdo.mapping, 0, b"\x00", "empty mapping")
    for entry, mapped in enumerate(pdo.codec.objects, start=1):
        _write(
            sdo,
            plan,
            pdo.mapping,
            entry,
            mapped.mapping_entry.to_bytes(4, "little"),
            f"map {mapped.name}",
        )
    _write(sdo, plan, pdo.mapping, 0, bytes((len(pdo.codec.objects),)), f"mapping of {names}")
    _write(sdo, plan, pdo.communication, 1, pdo.cob_id.to_bytes(4, "little"), "PDO on")


def _read(sdo: SdoPort, plan: NodePlan, index: int, subindex: int) -> int:
    try:
        return int.from_bytes(sdo.read(index, subindex), "little")
    except SdoError as error:
        raise NodeError(_who(plan), str(error)) from None


def _write(sdo: SdoPort, plan: NodePlan, index: int, subindex: int, payload: bytes, what: str) -> None:
    try:
        sdo.write(index, subindex, payload)
    except SdoError as error:
        raise NodeError(_who(plan), f"{what}: {error}; see {plan.key} in the machine file") from None


def _who(plan: NodePlan) -> str:
    return f"{plan.key} (node {plan.node_id})"
