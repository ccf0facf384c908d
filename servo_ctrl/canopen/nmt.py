"""Network management of CiA 301: the states that a heartbeat carries, and the commands of the master."""

from collections.abc import Iterable
from enum import IntEnum

from servo_ctrl.canopen.node_plan import NodePlan
from servo_ctrl.canopen.stack import Network


class NmtState(IntEnum):
    """NMT state in a heartbeat; `INITIALISING` is the boot-up message."""

    INITIALISING = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F


class NmtCommand(IntEnum):
    """Command specifier of an NMT message."""

    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


STATE_AFTER: dict[int, NmtState] = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
}
"""State after a command; the resets lead to a boot-up message."""


def command_nodes(network: Network, plans: Iterable[NodePlan], command: NmtCommand) -> None:
    """Send an NMT command to each of our nodes, by node id: other nodes on the bus are not ours."""
    for plan in plans:
        network.send_message(0x000, bytes((command, plan.node_id)))
