"""Boots nodes again beside the cycle while the machine stands by: one boot at a time, each wait bounded."""

import asyncio
from collections.abc import Sequence

from kernels.thread_priority import lower_priority
from servo_ctrl.canopen.boot import boot_nodes
from servo_ctrl.canopen.errors import BootError
from servo_ctrl.canopen.node_plan import NodePlan
from servo_ctrl.canopen.stack import Network
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.io.can_port import BusError

INPUTS_LIMIT_S = 5.0
"""Bounds the wait for the inputs of started nodes, due two SYNCs later; wall clock; chosen."""
POLL_S = 0.05
"""Interval at which that wait is checked; chosen."""
TRIES = 2
"""SDO tries before a node counts as absent; few, because the node responded just before; chosen."""


class BootAgain:
    """Boots nodes on request. The thread of the cycle calls `begin` and receives the result."""

    def __init__(
        self, network: Network, plans: Sequence[NodePlan], machine: MachineController, timeout_s: float
    ) -> None:
        self._network, self._plans, self._machine, self._timeout_s = network, plans, machine, timeout_s
        self._requests: asyncio.Queue[list[int]] = asyncio.Queue()

    def begin(self, nodes: list[int]) -> None:
        """Request a boot of the nodes with these indices; `MachineController.booted` receives the result."""
        self._requests.put_nowait(nodes)

    async def run(self) -> None:
        """Boot the requested nodes, until cancelled."""
        while True:
            plans = [self._plans[node] for node in await self._requests.get()]
            self._machine.booted(await self._problem(plans))
            await self._await_inputs()

    async def _problem(self, plans: Sequence[NodePlan]) -> str:
        try:
            await boot_nodes(self._network, plans, self._timeout_s, in_thread=lower_priority, tries=TRIES)
        except (BootError, BusError) as error:
            return str(error)
        return ""

    async def _await_inputs(self) -> None:
        loop = asyncio.get_running_loop()
        ends_s = loop.time() + INPUTS_LIMIT_S
        while self._machine.setting_up:
            if loop.time() > ends_s:
                self._machine.booted("no TPDOs are received from a node that was configured again")
            await asyncio.sleep(POLL_S)
