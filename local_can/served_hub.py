"""The hub in this process, and a party of it without a socket, which is used like a client's socket."""

import errno
import os
from collections.abc import Iterable
from pathlib import Path

from local_can.hub import Hub
from local_can.port import Party
from local_can.wire import FRAME_BYTES, MOST_FRAMES, overrun_frame

QUEUE_FRAMES = 16384
"""Frames that may wait, to a reader and from the party of this process; chosen."""
PATIENCE_S = 0.25
"""How long the bus waits for a reader whose queue is full; chosen."""
MOST_TURNS = 256
"""Bounds how often others may win the bus while a packet of ours is sent; what is left goes later. Chosen."""


class Inmate(Party):
    """A party in the hub's process: frames for it wait here until they are taken."""

    __slots__ = ("inbox",)

    def __init__(self) -> None:
        super().__init__()
        self.inbox = bytearray()

    def deliver(self, frame: bytes) -> None:
        """Keep `frame`, or count it as lost while there is no room."""
        if len(self.inbox) >= QUEUE_FRAMES * FRAME_BYTES:
            self.lost_frames += 1
            return
        if self.lost_frames:
            self.inbox += overrun_frame(self.lost_frames)
            self.lost_frames = 0
        self.inbox += frame

    def answer(self, packet: bytes) -> None:
        """Nothing: who is here already need not be told."""

    def flush(self) -> None:
        """Nothing: it takes its frames when it looks."""

    def close(self) -> None:
        """Nothing: it leaves with the hub."""


class ServedHub:
    """Serves the bus at `path`; `send`, `recv_into`, `fileno` and `close` are those of a client's socket.

    The file is readable when any client wants something: to read serves them all.

    Raises:
        HubError: See `Hub`.
    """

    def __init__(self, path: Path, packets: Iterable[bytes]) -> None:
        self._hub = Hub(path, bitrate=0, queue_frames=QUEUE_FRAMES, patience_s=PATIENCE_S)
        self._party = Inmate()
        self._hub.join(self._party)
        for packet in packets:
            self._hub.take(self._party, packet)

    @property
    def more(self) -> bool:
        """Whether frames wait here that make the file readable no more."""
        return bool(self._party.inbox) or self._hub.busy

    def send(self, packet: bytes) -> int:
        """Put a packet on the bus. Raises BlockingIOError while too many frames of ours wait for it."""
        if self._hub.waiting(self._party) > QUEUE_FRAMES:
            self._hub.turn(0.0)
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
        self._hub.take(self._party, packet)
        for _ in range(MOST_TURNS):
            if not self._hub.waiting(self._party):
                break
            self._hub.turn(0.0)
        return len(packet)

    def recv_into(self, buffer: bytearray) -> int:
        """Serve the bus, then take a packet of frames. Raises BlockingIOError where none has come."""
        inbox = self._party.inbox
        if not inbox:
            self._hub.turn(0.0)
        if not inbox:
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
        size = min(len(inbox), FRAME_BYTES * (MOST_FRAMES if self._party.bursts else 1))
        buffer[:size] = inbox[:size]
        del inbox[:size]
        return size

    def fileno(self) -> int:
        """File descriptor to wait on."""
        return self._hub.fileno()

    def close(self) -> None:
        """End the bus."""
        self._hub.close()
