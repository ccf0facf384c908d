"""The controller's own node: heartbeats before the first SYNC, EMCY for faults, status TPDO at a change."""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Sequence
from pathlib import Path

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.canopen import node as own
from servo_ctrl.canopen.nmt import NmtCommand, command_nodes
from servo_ctrl.canopen.node import ControllerNode
from servo_ctrl.canopen.node_plan import NodePlan
from servo_ctrl.canopen.own_settings import load_settings, write_settings
from servo_ctrl.canopen.stack import Network
from servo_ctrl.commands.handler import CommandHandler
from servo_ctrl.commands.stage import Stage
from servo_ctrl.commands.status_publisher import StatusPublisher
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.io.can_port import BusError

HEARTBEAT_POLL_S = 0.05
"""How often 1017h (producer heartbeat time) is read while it is 0; chosen."""

EMCY_OF_EVENT = {
    Event.LOST_HEARTBEAT: own.EMCY_HEARTBEAT,
    Event.LOST_TPDO: own.EMCY_PDO_TIMEOUT,
    Event.FOLLOWING_ERROR: own.EMCY_FOLLOWING_ERROR,
    Event.LIMIT: 0x8612,  # reference limit
    Event.LIMIT_SWITCH: 0x8612,
    Event.SENSORS_DISAGREE: 0x7320,  # position sensor
    Event.RUNAWAY: 0x7122,  # motor error or commutation malfunction
    Event.SATURATED: 0x2310,  # continuous over-current
    Event.FRAMES_LOST: 0x8110,  # CAN overrun
    Event.BUS_OFF: 0x8140,  # recovered from bus-off: it is sent once that is so
    Event.DUPLICATE_NODE: 0x8150,  # collision of COB-IDs
    Event.WRONG_PDO: 0x8210,  # PDO not processed for its length
    Event.OBJECT_CHANGED: 0x6320,  # parameters
}
"""Error codes of CiA 301 and CiA 402; any other event is a generic error."""


def stored_node(
    network: Network,
    config: MachineConfig,
    handler: CommandHandler,
    file: Path,
    worker: BackgroundWorker,
    note: Callable[[str], None],
) -> ControllerNode:
    """Make our node with the settings in `file`; the worker writes them when they change."""

    def store(values: dict[str, int] | None) -> None:
        worker.do(lambda: write_settings(file, values), lambda _done: None, note)

    return ControllerNode(network, config, handler, load_settings(file), store)


def fault_reporter(node: ControllerNode) -> Callable[[Event, str], None]:
    """Make the callback that sends an EMCY for a fault."""

    def on_fault(event: Event, text: str) -> None:
        with contextlib.suppress(BusError):  # the bus may be what failed
            node.report_error(EMCY_OF_EVENT.get(event, own.EMCY_GENERIC), text)

    return on_fault


def subscribe(node: ControllerNode, publisher: StatusPublisher) -> None:
    """Make the node send its status TPDO at a change and clear its error when a fault is over."""

    def changed() -> None:
        with contextlib.suppress(BusError):  # the port reports a failing bus by itself
            node.announce()

    def recovered() -> None:
        with contextlib.suppress(BusError):
            node.clear_error()

    publisher.on_change.append(changed)
    publisher.on_recovery.append(recovered)


@contextlib.asynccontextmanager
async def producing_heartbeats(node: ControllerNode) -> AsyncIterator[None]:
    """Send heartbeats while the block runs."""
    heartbeat = asyncio.create_task(_produce_heartbeats(node))
    try:
        yield
    finally:
        heartbeat.cancel()
        await asyncio.gather(heartbeat, return_exceptions=True)


async def _produce_heartbeats(node: ControllerNode) -> None:
    while True:
        node.send_heartbeat()
        await asyncio.sleep(node.heartbeat_s or HEARTBEAT_POLL_S)


def leave_nodes(network: Network, plans: Sequence[NodePlan], node: ControllerNode, stage: Stage) -> None:
    """Set the nodes pre-operational after the last cycle, or stopped while drives still follow set points.

    After a cancelled or crashed run such drives receive no controlword, but brake when stopped (6007h).
    """
    controlled = stage not in {Stage.BOOTING, Stage.OFF, Stage.STANDBY}
    with contextlib.suppress(BusError):  # then the drives stop by themselves: our heartbeat is missing
        command_nodes(network, plans, NmtCommand.STOP if controlled else NmtCommand.ENTER_PRE_OPERATIONAL)
        node.operational(running=False)
        node.send_heartbeat()
