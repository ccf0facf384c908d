"""Boots nodes again beside the cycle, for a machine that stands by: one job at a time, each wait bounded."""

import asyncio
from collections.abc import Sequence

from servo_ctrl.canopen.boot import boot_nodes
from servo_ctrl.canopen.errors import BootError
from servo_ctrl.canopen.node_plan import NodePlan
from servo_ctrl.canopen.stack import Network
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.cycle.realtime import step_back
from servo_ctrl.io.can_port import BusError

INPUTS_WITHIN_S = 5.0
"""Nodes that were started send their inputs two SYNCs later; bounds the wait, wall clock; chosen."""
LOOK_S = 0.05
TRIES = 2
"""SDO tries before a node counts as absent: it was heard just before; chosen."""


class BootAgain:
    """`begin` is called in the thread of the cycle, and so is what comes of it."""

    def __init__(
        self, network: Network, plans: Sequence[NodePlan], machine: MachineController, timeout_s: float
    ) -> None:
        self._network, self._plans, self._machine, self._timeout_s = network, plans, machine, timeout_s
        self._asked: asyncio.Queue[list[int]] = asyncio.Queue()

    def begin(self, nodes: list[int]) -> None:
        """Boot the nodes at these places; `MachineController.booted` tells what came of it."""
        self._asked.put_nowait(nodes)

    async def run(self) -> None:
        """Boot what is asked for, until cancelled."""
        while True:
            plans = [self._plans[node] for node in await self._asked.get()]
            self._machine.booted(await self._problem(plans))
            await self._await_inputs()

    async def _problem(self, plans: Sequence[NodePlan]) -> str:
        try:
            await boot_nodes(self._network, plans, self._timeout_s, in_thread=step_back, tries=TRIES)
        except (BootError, BusError) as error:
            return str(error)
        return ""

    async def _await_inputs(self) -> None:
        loop = asyncio.get_running_loop()
        ends_s = loop.time() + INPUTS_WITHIN_S
        while self._machine.setting_up:
            if loop.time() > ends_s:
                self._machine.booted("the cyclic inputs of a node that was set up again do not come")
            await asyncio.sleep(LOOK_S)
