"""A bus for a worker thread: the event loop reads frames, the thread takes them from a queue."""

import asyncio
import contextlib
import queue
from collections.abc import AsyncIterator

from servo_ctrl.io.can_port import CanPort, open_port


class BusWire:
    """Queues the frames of `port` for a worker thread."""

    def __init__(self, port: CanPort) -> None:
        self.send = port.send
        self._frames: queue.SimpleQueue[tuple[int, bytes]] = queue.SimpleQueue()
        port.fallback = lambda can_id, payload, _timestamp_s: self._frames.put((can_id, bytes(payload)))

    def receive(self, timeout_s: float) -> tuple[int, bytes] | None:
        """Return the next frame; None when none arrives in time."""
        try:
            return self._frames.get(timeout=timeout_s) if timeout_s > 0.0 else self._frames.get_nowait()
        except queue.Empty:
            return None


@contextlib.asynccontextmanager
async def bus_wire(bus: str) -> AsyncIterator[BusWire]:
    """Open a bus for the duration of the context. Raises BusError."""
    port = open_port(bus)
    try:
        port.attach(asyncio.get_running_loop())
        yield BusWire(port)
    finally:
        port.close()
