"""An operator panel on the bus: it commands by SDO and reads the status PDO of the controller.

It joins the bus only for each exchange, because a lockstep run is as fast as its slowest participant.
"""

import asyncio
import contextlib
import struct
from collections.abc import AsyncIterator, Callable, Iterator
from typing import NamedTuple

from servo_ctrl.canopen.node import load_own_eds
from servo_ctrl.canopen.remote_controller import RemoteController
from servo_ctrl.canopen.stack import Network
from servo_ctrl.commands.command import CommandRequest
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.io.can_port import BusError, CanPort, open_port

STATUS_PDO, SDO_RESPONSE = 0x180, 0x580
"""COB-IDs of the first TPDO and of the SDO response, less the node id (CiA 301)."""
STATUS_LAYOUT = struct.Struct("<4B2H")
"""Stage, learning state, due mask, axis being learned, progress per mille, J: docs/commands.md."""
STATUS_LIMIT_S = 10.0
"""Bounds the wait for a status PDO, sent ten times a second of machine time."""
POLL_S = 0.2
"""Interval of the readings of the status PDO, seconds; chosen."""


class PanelError(ServoCtrlError):
    """The controller refused a command, or an expected status did not arrive."""


class PanelStatus(NamedTuple):
    """Fields of a status PDO."""

    stage: int
    learning: int
    due_mask: int
    axis: int
    progress_permille: int


class OperatorPanel:
    """A panel for the controller of this machine. All calls may raise BusError."""

    def __init__(self, config: MachineConfig, bus: str) -> None:
        self._bus, self._node_id = bus, config.controller.node_id
        self._eds, self._axes = load_own_eds(config), tuple(config.axes)

    async def execute(self, request: CommandRequest) -> None:
        """Execute a command by SDO. Raises PanelError with the reason of a refusal, and SdoError."""
        async with self._remote() as controller:
            verdict = await asyncio.to_thread(controller.execute, request)
        if not verdict.accepted:
            raise PanelError(f"{request.command.name.lower()} was refused: {verdict.reason}")

    async def read(self) -> MachineStatus:
        """Read the status of the machine by SDO. Raises SdoError."""
        async with self._remote() as controller:
            return await asyncio.to_thread(controller.status)

    async def until(self, condition: Callable[[PanelStatus], bool], what: str, limit_s: float) -> PanelStatus:
        """Wait for a status PDO that fulfils the condition.

        Raises PanelError that names `what` after `limit_s`, or when the controller has stopped.
        """
        status: PanelStatus | None = None
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(limit_s):
                while True:
                    status = await self._next_status()
                    if condition(status):
                        return status
                    if status.stage >= Stage.STOPPING:
                        raise PanelError(f"{what} did not come: the controller has stopped")
                    await asyncio.sleep(POLL_S)
        raise PanelError(f"{what} did not come: not within {limit_s:g} s; the last status was {status}")

    async def _next_status(self) -> PanelStatus:
        """Receive the next status PDO. Raises PanelError when none arrives."""
        received: asyncio.Future[PanelStatus] = asyncio.get_running_loop().create_future()

        def receive(data: bytes, _timestamp_s: float) -> None:
            if len(data) == STATUS_LAYOUT.size and not received.done():
                received.set_result(PanelStatus(*STATUS_LAYOUT.unpack(data)[:5]))

        def fail(error: BusError) -> None:
            if not received.done():
                received.set_exception(error)

        with self._port() as port:
            port.on_down = fail
            port.handlers[STATUS_PDO + self._node_id] = receive
            port.attach(asyncio.get_running_loop())
            try:
                async with asyncio.timeout(STATUS_LIMIT_S):
                    return await received
            except TimeoutError:
                raise PanelError(f"no status PDO of the controller within {STATUS_LIMIT_S:g} s") from None

    @contextlib.asynccontextmanager
    async def _remote(self) -> AsyncIterator[RemoteController]:
        with self._port() as port:
            network = Network(port.send)
            answers = SDO_RESPONSE + self._node_id
            port.handlers[answers] = lambda data, stamp_s: network.notify(answers, bytearray(data), stamp_s)
            controller = RemoteController(network, self._node_id, self._eds, self._axes)
            port.attach(asyncio.get_running_loop())
            try:
                yield controller
            finally:
                controller.close()

    @contextlib.contextmanager
    def _port(self) -> Iterator[CanPort]:
        port = open_port(self._bus)
        try:
            yield port
        finally:
            port.close()
