"""Boots all nodes before the first SYNC, unless another controller or a signal prevents it."""

import asyncio
from collections.abc import Sequence
from typing import NamedTuple

from servo_ctrl.canopen.boot import boot_nodes
from servo_ctrl.canopen.node import ControllerNode
from servo_ctrl.canopen.node_plan import NodePlan
from servo_ctrl.canopen.stack import Network
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.run.foreign_frames import LISTENING_S, report_masters
from servo_ctrl.daemon.run.own_node import producing_heartbeats
from servo_ctrl.daemon.run.stop_signals import StoppedError
from servo_ctrl.io.can_port import BusError, CanPort


class RunBus(NamedTuple):
    """The open bus, the canopen library on it, and our node."""

    port: CanPort
    network: Network
    node: ControllerNode


class FirstBoot:
    """The boot of a run; `timeout_s` bounds the wait for each SDO response."""

    def __init__(self, config: MachineConfig, plans: Sequence[NodePlan], timeout_s: float) -> None:
        self._config, self._plans, self._timeout_s = config, plans, timeout_s
        self._task: asyncio.Task[None] | None = None
        self._signal = ""

    def stop(self, signal: str) -> bool:
        """End the boot at once because of this signal; return whether it was under way."""
        if self._task is None:
            return False
        self._signal = signal
        self._task.cancel()
        return True

    async def run(self, bus: RunBus) -> None:
        """Listen for another controller, then boot all nodes while our heartbeat follows the wall clock.

        Raises StoppedError after `stop`, BusError for another controller, and BootError.
        """
        others: set[str] = set()
        report_masters(self._config, self._plans, bus.port, others.add)
        self._task = asyncio.create_task(asyncio.sleep(LISTENING_S))
        try:
            await self._task
            if not others:
                bus.node.boot_up()
                self._task = asyncio.create_task(boot_nodes(bus.network, self._plans, self._timeout_s))
                async with producing_heartbeats(bus.node):
                    await self._task
        except asyncio.CancelledError:
            if not self._signal:
                raise
        finally:
            self._task = None
        if self._signal:
            raise StoppedError(self._signal)
        if others:
            raise BusError(min(others))
