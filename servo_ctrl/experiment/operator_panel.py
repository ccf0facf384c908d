"""An operator's panel on the bus: commands by SDO, and the status PDO of the controller."""

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
    from collections.abc import AsyncIterator, Callable

    from servo_ctrl.config.desk import DeskStatus, Request
    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.io.can_port import BusError

STATUS_PDO, SDO_ANSWER = 0x180, 0x580
STATUS_LAYOUT = struct.Struct("<4B2H")
"""Stage, learning state, due mask, axis being learned, progress per mille, J: docs/commands.md."""


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
    """Made by `operator_panel`."""

    def __init__(self, remote: RemoteDesk) -> None:
        self.last: Status | None = None
        self._remote = remote
        self._heard = asyncio.Event()
        self._down: BusError | None = None

    def hear(self, data: bytearray, _timestamp_s: float) -> None:
        """One status PDO; of another length it is none of ours."""
        if len(data) == STATUS_LAYOUT.size:
            self.last = Status(*STATUS_LAYOUT.unpack(data)[:5])
            self._heard.set()

    def fail(self, error: BusError) -> None:
        """The bus is gone."""
        self._down = error
        self._heard.set()

    async def execute(self, request: Request) -> None:
        """Give a command by SDO. Raises PanelError with the controller's reason, and SdoError."""
        verdict = await asyncio.to_thread(self._remote.execute, request)
        if not verdict.accepted:
            raise PanelError(f"{request.command.name.lower()} was refused: {verdict.reason}")

    async def read(self) -> DeskStatus:
        """All objects by SDO. Raises SdoError."""
        return await asyncio.to_thread(self._remote.status)

    async def until(self, condition: Callable[[Status], bool], what: str, limit_s: float) -> Status:
        """Wait for a status PDO that fulfils the condition. Raises PanelError naming `what` did not come."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(limit_s):
                while True:
                    if self._down is not None:
                        raise self._down
                    if self.last is not None and condition(self.last):
                        return self.last
                    if self.last is not None and self.last.stage >= Stage.STOPPING:
                        raise PanelError(f"{what} did not come: the controller has stopped")
                    self._heard.clear()
                    await self._heard.wait()
        raise PanelError(f"{what} did not come: not within {limit_s:g} s; the last status was {self.last}")


@contextlib.asynccontextmanager
async def operator_panel(config: MachineConfig, bus: str) -> AsyncIterator[OperatorPanel]:
    """A panel for the controller of this machine. Raises BusError."""
    node_id = config.controller.node_id
    port = open_port(bus)
    try:
        network = Network(port.send)
        remote = RemoteDesk(network, node_id, own_dictionary(config), tuple(config.axes))
        panel = OperatorPanel(remote)
        answers = SDO_ANSWER + node_id
        port.handlers[STATUS_PDO + node_id] = panel.hear
        port.handlers[answers] = lambda data, stamp_s: network.notify(answers, data, stamp_s)
        port.on_down = panel.fail
        port.attach(asyncio.get_running_loop())
        try:
            yield panel
        finally:
            remote.close()
    finally:
        port.close()
