"""Reads and writes objects of nodes by SDO while the cycle runs: one at a time, each wait bounded.

Writes to mapped objects and to the parameters of SYNC, EMCY, heartbeats and PDOs are refused, and any
write while axes move. The EDS gives the data types.
"""

import asyncio
from collections.abc import Callable, Sequence

from kernels.thread_priority import lower_priority
from servo_ctrl.canopen.errors import AbortCode, SdoError
from servo_ctrl.canopen.node_plan import NodePlan
from servo_ctrl.canopen.stack import EdsVariable, Network, SdoPort
from servo_ctrl.commands.command import Refusal
from servo_ctrl.commands.stage import Stage
from servo_ctrl.daemon.cycle.machine import MachineController
from servo_ctrl.daemon.page.object_values import decoded, encoded
from servo_ctrl.telemetry.local_socket.requests import Outcome

ACCESS_LIMIT_S = 1.0
"""Bounds the wait for another access and the wait for the access itself; chosen."""
TRIES = 2
RESPONSE_LIMIT_S = 0.3
"""Bounds the wait for one SDO response, so that all `TRIES` together stay below `ACCESS_LIMIT_S`."""
CYCLE_PARAMETERS = (range(0x1005, 0x1008), range(0x1012, 0x1018), range(0x1400, 0x1C00))
"""Indices of the parameters of SYNC, EMCY, heartbeats and PDOs (CiA 301)."""
AT_REST = (Stage.READY, Stage.STANDBY)


class ObjectAccess:
    """Refuses every access before `attach`."""

    def __init__(self, plans: Sequence[NodePlan], machine: MachineController) -> None:
        self._plans = {plan.node_id: plan for plan in plans}
        self._machine = machine
        self._network: Network | None = None
        self._lock = asyncio.Lock()

    def attach(self, network: Network) -> None:
        """Access the nodes through this network after their boot."""
        self._network = network

    async def read(self, node: int, index: int, subindex: int) -> Outcome:
        """Read an object: a number, text, or bytes in hexadecimal."""
        found = self._object(node, index, subindex)
        if isinstance(found, Outcome):
            return found
        plan, variable = found
        if variable.access == "wo":
            return Outcome(Refusal.WRONG_STATE, f"{variable.name} can only be written, its EDS says")
        return await self._access(plan, lambda port: decoded(variable, port.read(index, subindex)))

    async def write(self, node: int, index: int, subindex: int, value: float | str | bool) -> Outcome:
        """Write an object: a number, text, or bytes in hexadecimal."""
        found = self._object(node, index, subindex)
        if isinstance(found, Outcome):
            return found
        plan, variable = found
        if objection := self._objection(plan, variable):
            return Outcome(Refusal.WRONG_STATE, objection)
        try:
            data = encoded(variable, value)
        except ValueError as error:
            return Outcome(Refusal.OUT_OF_RANGE, f"{variable.name}: {error}")

        def write(port: SdoPort) -> None:
            port.write(index, subindex, data)

        return await self._access(plan, write)

    def _objection(self, plan: NodePlan, variable: EdsVariable) -> str:
        """Return why this object must not be written now, else ""."""
        name, address = variable.name, (variable.index, variable.subindex)
        if "w" not in variable.access:
            return f"{name} can only be read, its EDS says"
        if any(mapped.address == address for pdo in plan.pdos for mapped in pdo.codec.objects):
            return f"{name} is sent every cycle"
        if any(variable.index in indices for indices in CYCLE_PARAMETERS):
            return f"{name} configures the cyclic communication"
        stage = self._machine.stage
        if stage not in AT_REST:
            state = stage.words
            return f"the machine is {state}; objects are written when it is ready or in standby"
        return ""

    def _object(self, node: int, index: int, subindex: int) -> tuple[NodePlan, EdsVariable] | Outcome:
        plan = self._plans.get(node)
        if plan is None:
            known = ", ".join(str(node_id) for node_id in self._plans)
            return Outcome(Refusal.UNKNOWN, f"there is no node {node}, only {known}")
        variable = plan.eds.variables.get((index, subindex))
        if variable is None:
            return Outcome(Refusal.UNKNOWN, f"{plan.eds.path.name} has no object {index:04X}h:{subindex:02X}")
        return plan, variable

    async def _access(self, plan: NodePlan, access: Callable[[SdoPort], int | float | str | None]) -> Outcome:
        network = self._network
        if network is None:
            return Outcome(Refusal.WRONG_STATE, "the nodes are being booted")
        try:
            async with asyncio.timeout(ACCESS_LIMIT_S):
                await self._lock.acquire()
        except TimeoutError:
            return Outcome(Refusal.WRONG_STATE, "another object is being read or written")
        work = asyncio.get_running_loop().run_in_executor(None, _transfer, network, plan.node_id, access)
        work.add_done_callback(lambda _work: self._lock.release())
        try:
            async with asyncio.timeout(ACCESS_LIMIT_S):
                return Outcome(value=await asyncio.shield(work))
        except SdoError as error:
            return Outcome(_refusal(error), str(error))
        except TimeoutError:
            # retrieve a late exception, which no caller awaits any more
            work.add_done_callback(lambda _work: _work.cancelled() or _work.exception())
            return Outcome(
                Refusal.WRONG_STATE, f"node {plan.node_id} was not done within {ACCESS_LIMIT_S:g} s"
            )


def _transfer(
    network: Network, node_id: int, access: Callable[[SdoPort], int | float | str | None]
) -> int | float | str | None:
    """Run one access, in a thread of its own."""
    lower_priority()
    port = SdoPort(network, node_id, timeout_s=RESPONSE_LIMIT_S, tries=TRIES)
    try:
        return access(port)
    finally:
        port.close()


def _refusal(error: SdoError) -> Refusal:
    match error.abort_code:
        case AbortCode.VALUE_TOO_HIGH | AbortCode.VALUE_TOO_LOW | AbortCode.INVALID_VALUE:
            return Refusal.OUT_OF_RANGE
        case AbortCode.NO_SUCH_OBJECT | AbortCode.NO_SUCH_SUBINDEX:
            return Refusal.UNKNOWN
    return Refusal.WRONG_STATE
