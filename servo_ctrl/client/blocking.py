"""`servo_ctrl.Client`: the same client for programs without asyncio."""

import asyncio
import threading
from collections.abc import Coroutine, Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeVar

from servo_ctrl.client.client import AsyncClient
from servo_ctrl.commands.learning_status import LearningStatus
from servo_ctrl.commands.machine_status import MachineStatus

Answer = TypeVar("Answer")


class Client:
    """A running controller: `with Client("xy_table", "socketcan:vcan0") as controller: ...`.

    Every call blocks until the controller has answered; it raises the errors of AsyncClient.
    """

    def __init__(self, machine: Path | str, bus: str) -> None:
        self._client = AsyncClient(machine, bus)
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="servo-ctrl client", daemon=True)

    def __enter__(self) -> Self:
        """Open the bus and check that the node is our controller."""
        self._thread.start()
        try:
            self._wait(self._client.__aenter__())
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the bus; the controller continues."""
        try:
            self._wait(self._client.__aexit__(None, None, None))
        finally:
            self._end()

    def command(self, word: str, axis: str = "") -> None:
        """Carry out a command of `servo-ctrl ask`, of an axis or of all. Raises CommandRefusedError."""
        self._wait(self._client.command(word, axis))

    def enable(self) -> None:
        """Switch the drives on from standby."""
        self._wait(self._client.enable())

    def disable(self) -> None:
        """Come to rest, then power off."""
        self._wait(self._client.disable())

    def run(self) -> None:
        """Start the controller's program once more."""
        self._wait(self._client.run())

    def learn(self, axis: str = "") -> None:
        """Begin to learn the friction compensation of an axis, or of all."""
        self._wait(self._client.learn(axis))

    def change(self, setting: str, value: float | str | bool) -> None:
        """Change a setting of `servo-ctrl ask set`; numbers in SI. Raises CommandRefusedError."""
        self._wait(self._client.change(setting, value))

    def status(self) -> MachineStatus:
        """Read the status of machine and axes."""
        return self._wait(self._client.status())

    def learning(self) -> LearningStatus:
        """Read the progress of learning."""
        return self._wait(self._client.learning())

    def subscribe(self, period_s: float = 0.5) -> Iterator[MachineStatus]:
        """Yield the status every `period_s` until the caller stops."""
        while True:
            yield self.status()
            self._wait(asyncio.sleep(period_s))

    def _wait(self, work: Coroutine[Any, Any, Answer]) -> Answer:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result()

    def _end(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()
