"""A bus has one controller: hear another one before anything is sent, and while the cycle runs."""

from collections.abc import Callable, Sequence

from servo_ctrl.canopen.plan import NodePlan
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.io.can_port import CanPort

SYNC_COB_ID = 0x080
LISTENING_S = 0.25
"""Longer than the longest SYNC period, and than two heartbeats at their usual distance."""


def report_others(
    config: MachineConfig, plans: Sequence[NodePlan], port: CanPort, report: Callable[[str], None]
) -> None:
    """From now on tell `report` of every frame that only a controller of this machine may send."""
    node_id = config.controller.node_id
    ours = {SYNC_COB_ID: "SYNC", 0x700 + node_id: f"heartbeats of node {node_id}, which is ours"}
    for plan in plans:
        for pdo in plan.pdos:
            if pdo.communication < 0x1800:
                ours[pdo.cob_id] = f"set points for {plan.key}"
    for can_id, what in ours.items():
        text = f"bus {port.name}: another controller sends {what}; only one may run"
        port.handlers[can_id] = _handler(report, text)


def _handler(report: Callable[[str], None], text: str) -> Callable[[bytearray, float], None]:
    return lambda _payload, _timestamp_s: report(text)
