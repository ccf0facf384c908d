"""`servo_ctrl.AsyncClient` and `servo_ctrl.Client`: command a running controller and read its status."""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from types import TracebackType
from typing import Self, TypeVar

from servo_ctrl.canopen.remote_controller import RemoteController
from servo_ctrl.client.connection import connected
from servo_ctrl.commands.command import COMMAND_WORDS, CommandRequest, CommandResult
from servo_ctrl.commands.learning_status import LearningStatus
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.settings import SETTINGS
from servo_ctrl.config.load import load_machine
from servo_ctrl.errors import ServoCtrlError
from shipped_files import shipped

Answer = TypeVar("Answer")
SETTING_OF = {setting.word: name for name, setting in SETTINGS.items()}


class CommandRefusedError(ServoCtrlError):
    """The controller refused a request; the message gives the reason."""


class AsyncClient:
    """A running controller: `async with AsyncClient("xy_table", "socketcan:vcan0") as controller: ...`.

    All calls raise SdoError when it does not answer within its bound, and BusError when the bus is lost.
    """

    def __init__(self, machine: Path | str, bus: str) -> None:
        self.machine = load_machine(shipped(Path(machine)))
        self._bus = bus
        self._open = contextlib.AsyncExitStack()
        self._busy = asyncio.Lock()  # one SDO request at a time: a server has one channel
        self._remote: RemoteController | None = None

    async def __aenter__(self) -> Self:
        """Open the bus and check that the node is our controller."""
        self._remote = await self._open.enter_async_context(connected(self.machine, self._bus))
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the bus; the controller continues."""
        self._remote = None
        await self._open.__aexit__(kind, error, trace)

    async def command(self, word: str, axis: str = "") -> None:
        """Carry out a command of `servo-ctrl request`, of an axis or of all. Raises CommandRefusedError."""
        if word not in COMMAND_WORDS:
            raise CommandRefusedError(f'"{word}" is not a command; known are {", ".join(COMMAND_WORDS)}')
        if axis and axis not in self.machine.axes:
            raise CommandRefusedError(f'no axis "{axis}"; the machine has {", ".join(self.machine.axes)}')
        request = CommandRequest(COMMAND_WORDS[word], axis)
        _accepted(await self._request(lambda remote: remote.execute(request)))

    async def enable(self) -> None:
        """Switch the drives on from standby."""
        await self.command("switch-on")

    async def disable(self) -> None:
        """Come to rest, then power off."""
        await self.command("switch-off")

    async def run(self) -> None:
        """Start the controller's program once more."""
        await self.command("start-program")

    async def learn(self, axis: str = "") -> None:
        """Begin to learn the friction compensation of an axis, or of all."""
        await self.command("start-learning", axis)

    async def change(self, setting: str, value: float | str | bool) -> None:
        """Change a setting of `servo-ctrl request set`; numbers in SI. Raises CommandRefusedError."""
        if setting not in SETTING_OF:
            raise CommandRefusedError(f'"{setting}" is not a setting; known are {", ".join(SETTING_OF)}')
        _accepted(await self._request(lambda remote: remote.change(SETTING_OF[setting], value)))

    async def status(self) -> MachineStatus:
        """Read the status of machine and axes."""
        return await self._request(lambda remote: remote.status())

    async def learning(self) -> LearningStatus:
        """Read the progress of learning."""
        return await self._request(lambda remote: remote.learning())

    async def subscribe(self, period_s: float = 0.5) -> AsyncIterator[MachineStatus]:
        """Yield the status every `period_s` until the caller stops."""
        while True:
            yield await self.status()
            await asyncio.sleep(period_s)

    async def _request(self, request: Callable[[RemoteController], Answer]) -> Answer:
        """Return the result of a blocking request, made in a worker thread."""
        if self._remote is None:
            raise ServoCtrlError("not connected: use the client within its `with` block")
        async with self._busy:
            return await asyncio.to_thread(request, self._remote)


def _accepted(result: CommandResult) -> None:
    if not result.accepted:
        raise CommandRefusedError(f"refused: {result.reason}")
