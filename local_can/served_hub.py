"""A hub in this process, used like a client's socket by the client of this process."""

import errno
import os
from collections.abc import Iterable
from pathlib import Path

from can_frames.frame import overrun_frame
from local_can.hub import Hub
from local_can.port import Client
from local_can.wire import FRAME_BYTES, MOST_FRAMES, split

QUEUE_FRAMES = 16384
"""Bounds the frames that wait for a reader, and from the client of this process; chosen."""
PATIENCE_S = 0.25
"""How long the bus waits for a reader whose queue is full; chosen."""
MOST_TURNS = 256
"""Bounds the turns that others win while a packet of this process is sent; the rest follows later. Chosen."""


class InProcessClient(Client):
    """The client in the hub's process, whose frames wait here until they are read."""

    __slots__ = ("inbox",)

    def __init__(self) -> None:
        super().__init__()
        self.inbox = bytearray()

    def deliver(self, packet: bytes) -> None:
        """Keep the frames of a packet; count those as lost for which there is no space."""
        room = len(self.inbox) + len(packet) <= QUEUE_FRAMES * FRAME_BYTES
        if len(packet) > FRAME_BYTES and not room:
            for frame in split(packet):
                self.deliver(frame)
        elif not room:
            self.lost_frames += 1
        else:
            if self.lost_frames:
                self.inbox += overrun_frame(self.lost_frames)
                self.lost_frames = 0
            self.inbox += packet

    def answer(self, packet: bytes) -> None:
        """Do nothing: this client needs no answer."""

    def flush(self) -> None:
        """Do nothing: this client reads its frames itself."""

    def close(self) -> None:
        """Do nothing: this client ends with the hub."""


class ServedHub:
    """Serves the bus at `path`; `send`, `recv_into`, `fileno`, `close` act like those of a client's socket.

    The file is readable when any client needs service; reading serves all clients.

    Raises:
        HubError: See `Hub`.
    """

    def __init__(self, path: Path, packets: Iterable[bytes]) -> None:
        self._hub = Hub(path, bitrate=0, queue_frames=QUEUE_FRAMES, patience_s=PATIENCE_S)
        self._client = InProcessClient()
        self._hub.join(self._client)
        for packet in packets:
            self._hub.take(self._client, packet)

    @property
    def more(self) -> bool:
        """Whether frames wait although the file is not readable."""
        return bool(self._client.inbox) or self._hub.busy

    @property
    def peers(self) -> list[int]:
        """Process ids of the clients that are on the bus."""
        return self._hub.peers

    def send(self, packet: bytes) -> int:
        """Send a packet to the bus. Raises BlockingIOError while too many of our frames wait for it."""
        if self._hub.waiting(self._client) > QUEUE_FRAMES:
            self._hub.turn(0.0)
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
        self._hub.take(self._client, packet)
        for _ in range(MOST_TURNS):
            if not self._hub.waiting(self._client):
                break
            self._hub.turn(0.0)
        return len(packet)

    def recv_into(self, buffer: bytearray) -> int:
        """Serve the bus, then read a packet of frames. Raises BlockingIOError if there is none."""
        burst = self.receive(MOST_FRAMES if self._client.bursts else 1)
        if not burst:
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
        buffer[: len(burst)] = burst
        return len(burst)

    def receive(self, most_frames: int) -> bytearray:
        """Serve the bus, then take at most so many frames; there may be none."""
        client = self._client
        if not client.inbox:
            self._hub.turn(0.0)
        inbox, size = client.inbox, most_frames * FRAME_BYTES
        if len(inbox) <= size:
            client.inbox = bytearray()
            return inbox
        burst = inbox[:size]
        del inbox[:size]
        return burst

    def fileno(self) -> int:
        """File descriptor to wait on."""
        return self._hub.fileno()

    def close(self) -> None:
        """End the hub."""
        self._hub.close()
