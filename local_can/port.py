"""One client of the hub: its socket, and the queue of frames for it."""

import logging
import select
import socket
from collections import deque

from local_can.wire import PASS_ALL, overrun_frame

_LOG = logging.getLogger(__name__)


class Port:
    """A client's socket with a bounded output queue.

    A frame goes to the socket while it has room, else to the queue. When the queue is full too, the whole bus
    waits for this reader up to `patience_s`; then the reader loses frames until it has read all that was
    sent to it. The loss is logged, and the client gets an error frame that counts it, at the
    place where the frames are missing.
    """

    __slots__ = (
        "_epoll",
        "_patience_ms",
        "_queue",
        "_queue_frames",
        "_send",
        "attached",
        "filters",
        "lost_frames",
        "sock",
        "wants_own",
    )

    def __init__(
        self, sock: socket.socket, epoll: select.epoll, queue_frames: int, patience_s: float
    ) -> None:
        self.sock = sock
        self.attached = False  # whether the client is on the bus
        self.wants_own = False  # whether its own frames go back to it too
        self.filters = PASS_ALL  # of the frames that go to it
        self.lost_frames = 0  # of the loss that is going on; 0 if there is none
        self._send = sock.send
        self._epoll = epoll
        self._queue: deque[bytes] = deque()
        self._queue_frames = max(queue_frames, 1)
        self._patience_ms = patience_s * 1000.0

    def deliver(self, frame: bytes) -> None:
        """Send `frame` to the client, or queue it; count it as lost when neither is possible."""
        if self._queue or self.lost_frames:
            if not self._has_room():
                self.lost_frames += 1
                return
            if self._queue:
                self._queue.append(frame)
                return
        try:
            self._send(frame)
        except BlockingIOError:
            self._epoll.modify(self.sock, select.EPOLLIN | select.EPOLLOUT)
            self._queue.append(frame)
        except OSError:
            # The client went away; the hub learns so by reading, and closes the port there.
            return

    def flush(self) -> None:
        """Send the queue as far as the socket has room, and report a loss once it is empty."""
        queue = self._queue
        try:
            while queue:
                self._send(queue[0])
                queue.popleft()
            if self.lost_frames:
                self._send(overrun_frame(self.lost_frames))
        except BlockingIOError:
            return
        except OSError:
            queue.clear()
        if self.lost_frames:
            _LOG.warning("client %d lost %d frames, reading too late", self.sock.fileno(), self.lost_frames)
            self.lost_frames = 0
        self._epoll.modify(self.sock, select.EPOLLIN)

    def _has_room(self) -> bool:
        """Whether one more frame may wait; this is where the bus waits for a slow reader."""
        if self.lost_frames:
            return False
        if len(self._queue) < self._queue_frames:
            return True
        writable = select.poll()
        writable.register(self.sock, select.POLLOUT)
        if writable.poll(self._patience_ms):
            self.flush()
        if len(self._queue) < self._queue_frames:
            return True
        _LOG.warning("client %d reads too late and is losing frames", self.sock.fileno())
        return False
