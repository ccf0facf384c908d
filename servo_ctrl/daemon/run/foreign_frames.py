"""Frames that only we may send, sent by others: a duplicate master, and writes to our nodes by SDO."""

from collections.abc import Callable, Sequence
from functools import partial

from servo_ctrl.canopen.plan import NodePlan
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.io.can_port import CanPort

SYNC_COB_ID = 0x080
LISTENING_S = 0.25
"""Before anything is sent: longer than the longest SYNC period, and than two usual heartbeats."""
FIRST_TPDO = 0x1800
"""Index of the first TPDO's communication parameters; those of RPDOs are below it (CiA 301)."""
SDO_REQUEST = 0x600
DOWNLOADS = {1, 6}
"""Client command specifiers that begin a download: initiate, and initiate block."""
SDO_BYTES = 8


def report_masters(
    config: MachineConfig, plans: Sequence[NodePlan], port: CanPort, report: Callable[[str], object]
) -> None:
    """From now on call `report` for every frame that only a controller of this machine may send."""
    node_id = config.controller.node_id
    ours = {SYNC_COB_ID: "SYNC", 0x700 + node_id: f"heartbeats of node {node_id}, which is ours"}
    for plan in plans:
        for pdo in plan.pdos:
            if pdo.communication < FIRST_TPDO:
                ours[pdo.cob_id] = f"set points for {plan.key}"
    for can_id, what in ours.items():
        text = f"bus {port.name}: another controller sends {what}; only one may run"
        port.handlers[can_id] = partial(_on_foreign, report, text)


def _on_foreign(report: Callable[[str], object], text: str, _payload: bytearray, _timestamp_s: float) -> None:
    report(text)


def report_writes(plans: Sequence[NodePlan], port: CanPort, report: Callable[[int, str], None]) -> None:
    """Call `report` for every download to a node (its place among the plans) that is not ours, as it begins.

    What boot has checked and set is uncertain from then on. The port does not receive what we send ourselves.
    A write that the node refuses is reported too: somebody is at work on a machine that moves.
    """
    for place, plan in enumerate(plans):
        port.handlers[SDO_REQUEST + plan.node_id] = partial(_on_request, plan, partial(report, place))


def _on_request(
    plan: NodePlan, report: Callable[[str], None], payload: bytearray, _timestamp_s: float
) -> None:
    if len(payload) == SDO_BYTES and payload[0] >> 5 in DOWNLOADS:
        index, subindex = int.from_bytes(payload[1:3], "little"), payload[3]
        variable = plan.eds.variables.get((index, subindex))
        name = f" ({variable.name})" if variable is not None else ""
        report(f"{plan.name}: somebody else writes {index:04X}h:{subindex:02X}{name}")
