"""The clients of a hub: the interface `Client`, and a client behind a socket with its queue of frames."""

import logging
import select
import socket
from abc import ABC, abstractmethod
from collections import deque
from itertools import islice

from can_frames.frame import overrun_frame
from local_can.wire import FRAME_BYTES, MOST_BYTES, PASS_ALL, split

_LOG = logging.getLogger(__name__)


class Client(ABC):
    """A client of the bus, attached or not yet."""

    __slots__ = ("attached", "bursts", "filters", "lost_frames", "wants_own")

    def __init__(self) -> None:
        self.attached = False  # whether it is on the bus
        self.wants_own = False  # whether it also receives its own frames
        self.bursts = False  # whether it accepts several frames in one packet
        self.filters = PASS_ALL  # select the frames that it receives
        self.lost_frames = 0  # frames of the present loss; 0 without one

    @abstractmethod
    def deliver(self, packet: bytes) -> None:
        """Keep the frames of a packet for the next flush; count those as lost for which there is no space."""

    @abstractmethod
    def answer(self, packet: bytes) -> None:
        """Send a packet that is not a frame, before all frames."""

    @abstractmethod
    def flush(self) -> None:
        """Send the kept frames."""

    @abstractmethod
    def close(self) -> None:
        """End the connection."""


class Port(Client):
    """A client's socket with a bounded output queue.

    Frames wait in the queue until the hub flushes it, or longer if the socket has no space. When the queue
    is full, the whole bus waits for this reader up to `patience_s`; then the reader loses frames until it has
    read all earlier ones. The loss is logged, and the client gets an error frame that counts it in the place
    of the missing frames.
    """

    __slots__ = (
        "_epoll",
        "_patience_ms",
        "_queue",
        "_queue_frames",
        "_send",
        "_waiting",
        "_waits_for_room",
        "sock",
    )

    def __init__(
        self, sock: socket.socket, epoll: select.epoll, queue_frames: int, patience_s: float
    ) -> None:
        super().__init__()
        self.sock = sock
        self._send = sock.send
        self._epoll = epoll
        self._queue: deque[bytes] = deque()  # packets of one frame or more
        self._waiting = 0  # frames in it
        self._queue_frames = max(queue_frames, 1)
        self._patience_ms = patience_s * 1000.0
        self._waits_for_room = False

    def deliver(self, packet: bytes) -> None:
        """Queue the frames of a packet for the client; count those as lost for which there is no space."""
        count = len(packet) // FRAME_BYTES
        room = self._waiting + count <= self._queue_frames
        if count > 1 and not (self.bursts and room and not self.lost_frames):
            for frame in split(packet):
                self.deliver(frame)
        elif self.lost_frames or not (room or self._make_room()):
            self.lost_frames += 1
        else:
            self._queue.append(packet)
            self._waiting += count

    def answer(self, packet: bytes) -> None:
        """Send a packet that is not a frame, before all frames."""
        try:
            self._send(packet)
        except OSError:
            return  # the client has disconnected

    def flush(self) -> None:
        """Send the queue as far as the socket has space, and report a loss once it is empty."""
        queue = self._queue
        try:
            while queue:
                packet, count = queue[0], 1
                if self.bursts and len(queue) > 1:
                    count = self._fitting()
                    packet = b"".join(islice(queue, count))
                self._send(packet)
                self._waiting -= len(packet) // FRAME_BYTES
                for _ in range(count):
                    queue.popleft()
            if self.lost_frames:
                self._send(overrun_frame(self.lost_frames))
        except BlockingIOError:
            if not self._waits_for_room:
                self._epoll.modify(self.sock, select.EPOLLIN | select.EPOLLOUT)
                self._waits_for_room = True
            return
        except OSError:
            self._waiting = 0
            queue.clear()  # the client disconnected; the hub detects it when reading, and closes the port
        if self.lost_frames:
            _LOG.warning("client %d lost %d frames, reading too late", self.sock.fileno(), self.lost_frames)
            self.lost_frames = 0
        if self._waits_for_room:
            self._epoll.modify(self.sock, select.EPOLLIN)
            self._waits_for_room = False

    def close(self) -> None:
        """Close the connection."""
        self.sock.close()

    def _fitting(self) -> int:
        """Return how many of the queued packets fit into one."""
        count = size = 0
        for packet in self._queue:
            size += len(packet)
            if size > MOST_BYTES:
                break
            count += 1
        return count

    def _make_room(self) -> bool:
        """Wait for a slow reader if necessary; return whether one more frame may wait."""
        self.flush()
        if self._waiting < self._queue_frames:
            return True
        writable = select.poll()
        writable.register(self.sock, select.POLLOUT)
        if writable.poll(self._patience_ms):
            self.flush()
        if self._waiting < self._queue_frames:
            return True
        _LOG.warning("client %d reads too late and is losing frames", self.sock.fileno())
        return False
