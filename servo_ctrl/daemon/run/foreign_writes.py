"""Who else writes to our nodes by SDO: what boot has checked and set is not sure any more."""

from collections.abc import Callable, Sequence

from servo_ctrl.canopen.plan import NodePlan
from servo_ctrl.io.can_port import CanPort

SDO_REQUEST = 0x600
DOWNLOADS = {1, 6}
"""Client command specifiers that begin a download: initiate, and initiate block."""
SDO_BYTES = 8


def report_writes(plans: Sequence[NodePlan], port: CanPort, report: Callable[[int, str], None]) -> None:
    """Tell `report` of every download to a node (its place among the plans) that is not ours, as it begins.

    What we send ourselves the port does not hear. A write that the node refuses is told too: who tries is at
    work on a machine that moves.
    """
    for place, plan in enumerate(plans):
        port.handlers[SDO_REQUEST + plan.node_id] = _handler(place, plan, report)


def _handler(
    place: int, plan: NodePlan, report: Callable[[int, str], None]
) -> Callable[[bytearray, float], None]:
    def on_request(payload: bytearray, _timestamp_s: float) -> None:
        if len(payload) == SDO_BYTES and payload[0] >> 5 in DOWNLOADS:
            index, subindex = int.from_bytes(payload[1:3], "little"), payload[3]
            variable = plan.eds.variables.get((index, subindex))
            name = f" ({variable.name})" if variable is not None else ""
            report(place, f"{plan.name}: somebody else writes {index:04X}h:{subindex:02X}{name}")

    return on_request
