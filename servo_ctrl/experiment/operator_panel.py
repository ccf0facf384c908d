"""An operator's panel on the bus: commands by SDO, and the status PDO of the controller.

It is on the bus only while it asks or looks: a lockstep is as fast as its slowest listener.
"""

from __future__ import annotations

import asyncio
import contextlib
import struct
from typing import TYPE_CHECKING, NamedTuple

from servo_ctrl.axis.fault_policy import Stage
from servo_ctrl.canopen.node import own_dictionary
from servo_ctrl.canopen.remote_desk import RemoteDesk
from servo_ctrl.canopen.stack import Network
from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.io.can_port import open_port

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Iterator

    from servo_ctrl.config.desk import DeskStatus, Request
    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.io.can_port import BusError, CanPort

STATUS_PDO, SDO_ANSWER = 0x180, 0x580
STATUS_LAYOUT = struct.Struct("<4B2H")
"""Stage, learning state, due mask, axis being learned, progress per mille, J: docs/commands.md."""
STATUS_LIMIT_S = 10.0
"""A status PDO comes ten times a second of machine time."""
LOOK_S = 0.2
"""Between two looks."""


class PanelError(ServoCtrlError):
    """The controller refused, or what was waited for did not come."""


class Status(NamedTuple):
    """What a status PDO says."""

    stage: int
    learning: int
    due_mask: int
    axis: int
    progress_permille: int


class OperatorPanel:
    """A panel for the controller of this machine. All its calls may raise BusError."""

    def __init__(self, config: MachineConfig, bus: str) -> None:
        self._bus, self._node_id = bus, config.controller.node_id
        self._eds, self._axes = own_dictionary(config), tuple(config.axes)

    async def execute(self, request: Request) -> None:
        """Give a command by SDO. Raises PanelError with the controller's reason, and SdoError."""
        async with self._desk() as desk:
            verdict = await asyncio.to_thread(desk.execute, request)
        if not verdict.accepted:
            raise PanelError(f"{request.command.name.lower()} was refused: {verdict.reason}")

    async def read(self) -> DeskStatus:
        """All objects by SDO. Raises SdoError."""
        async with self._desk() as desk:
            return await asyncio.to_thread(desk.status)

    async def until(self, condition: Callable[[Status], bool], what: str, limit_s: float) -> Status:
        """Wait for a status PDO that fulfils the condition.

        Raises PanelError naming `what` did not come: too late, or the controller has stopped.
        """
        status: Status | None = None
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(limit_s):
                while True:
                    status = await self._look()
                    if condition(status):
                        return status
                    if status.stage >= Stage.STOPPING:
                        raise PanelError(f"{what} did not come: the controller has stopped")
                    await asyncio.sleep(LOOK_S)
        raise PanelError(f"{what} did not come: not within {limit_s:g} s; the last status was {status}")

    async def _look(self) -> Status:
        """The next status PDO. Raises PanelError when there is none."""
        heard: asyncio.Future[Status] = asyncio.get_running_loop().create_future()

        def hear(data: bytearray, _timestamp_s: float) -> None:
            if len(data) == STATUS_LAYOUT.size and not heard.done():
                heard.set_result(Status(*STATUS_LAYOUT.unpack(data)[:5]))

        def fail(error: BusError) -> None:
            if not heard.done():
                heard.set_exception(error)

        with self._port() as port:
            port.on_down = fail
            port.handlers[STATUS_PDO + self._node_id] = hear
            port.attach(asyncio.get_running_loop())
            try:
                async with asyncio.timeout(STATUS_LIMIT_S):
                    return await heard
            except TimeoutError:
                raise PanelError(f"no status PDO of the controller within {STATUS_LIMIT_S:g} s") from None

    @contextlib.asynccontextmanager
    async def _desk(self) -> AsyncIterator[RemoteDesk]:
        with self._port() as port:
            network = Network(port.send)
            answers = SDO_ANSWER + self._node_id
            port.handlers[answers] = lambda data, stamp_s: network.notify(answers, data, stamp_s)
            desk = RemoteDesk(network, self._node_id, self._eds, self._axes)
            port.attach(asyncio.get_running_loop())
            try:
                yield desk
            finally:
                desk.close()

    @contextlib.contextmanager
    def _port(self) -> Iterator[CanPort]:
        port = open_port(self._bus)
        try:
            yield port
        finally:
            port.close()
