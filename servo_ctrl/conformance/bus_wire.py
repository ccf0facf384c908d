"""A bus as a worker thread talks on it: the loop reads, the thread takes from a queue."""

import asyncio
import contextlib
import queue
from collections.abc import AsyncIterator

from servo_ctrl.io.can_port import CanPort, open_port


class BusWire:
    """Frames of `port`, which the running loop reads."""

    def __init__(self, port: CanPort) -> None:
        self.send = port.send
        self._frames: queue.SimpleQueue[tuple[int, bytes]] = queue.SimpleQueue()
        port.fallback = lambda can_id, payload, _timestamp_s: self._frames.put((can_id, bytes(payload)))

    def receive(self, timeout_s: float) -> tuple[int, bytes] | None:
        """The next frame, None when none has come in time."""
        try:
            return self._frames.get(timeout=timeout_s) if timeout_s > 0.0 else self._frames.get_nowait()
        except queue.Empty:
            return None


@contextlib.asynccontextmanager
async def bus_wire(bus: str) -> AsyncIterator[BusWire]:
    """Open a bus for as long as the context lasts. Raises BusError."""
    port = open_port(bus)
    try:
        port.attach(asyncio.get_running_loop())
        yield BusWire(port)
    finally:
        port.close()
