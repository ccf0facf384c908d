"""Sends and receives bursts of frames through a python-can bus, with fast paths for localcan and SocketCAN.

Every other python-can interface handles frames one by one. Callers wait on the file of the bus.
"""

import errno
import socket
import time
from collections.abc import Callable, Collection, Iterator
from typing import NamedTuple, Protocol, TypeVar

from can_frames.frame import ERROR, EXTENDED, FRAME, FRAME_BYTES, IDENTIFIER_MASK, REMOTE, overrun_frame
from can_frames.message_batch import MOST_FRAMES, BatchSocket
from kernels.lean_import import as_if_absent

with as_if_absent("asammdf"):  # python-can loads it, and pandas, for MF4 logs: 0.5 s of every start
    import can
    from can.interfaces.socketcan import SocketcanBus

T = TypeVar("T")

MOST_BYTES = FRAME_BYTES * MOST_FRAMES
PAUSE_S = 2e-4
"""Pause before another try while a transmit queue is full: 1.5 frames at 1 Mbit/s."""
FULL = frozenset({errno.ENOBUFS, errno.EAGAIN})
"""Error codes of a full transmit queue; SocketCAN, with ten frames by default, raises the first."""


class SendTimeouts(NamedTuple):
    """Longest waits of a send, seconds: for a full queue, and in the interface (None: its default)."""

    queue_s: float
    interface_s: float | None


class FrameBus(Protocol):
    """The bus that a CAN port reads and writes. All methods raise the errors of python-can or the system."""

    @property
    def more(self) -> bool:
        """Whether frames wait although the file to wait on is not readable."""

    @property
    def peers(self) -> Collection[int]:
        """Process ids at the other end; empty where the interface does not tell."""

    def waiting(self) -> Iterator[bytearray]:
        """Yield the received bursts; later frames may be among them or make the file readable again."""

    def send(self, frames: bytes) -> None:
        """Send the frames of a burst in order."""


def frame_bus(bus: can.BusABC, timeouts: SendTimeouts) -> FrameBus:
    """Return the fastest `FrameBus` for a bus that has no other reader."""
    if hasattr(bus, "start_bursts"):
        bus.start_bursts()
        return _BurstBus(bus, timeouts)
    if isinstance(bus, SocketcanBus):
        return _SocketBus(bus.socket, timeouts)
    return _MessageBus(bus, timeouts)


class _BurstBus:
    """An interface that transfers bursts itself, such as localcan."""

    def __init__(self, bus: can.BusABC, timeouts: SendTimeouts) -> None:
        self._bus = bus
        self._receive, self._send = bus.receive_burst, bus.send_burst  # type: ignore[attr-defined]  # it has
        self._timeout_s = timeouts.interface_s

    @property
    def more(self) -> bool:
        return bool(self._bus.more)  # type: ignore[attr-defined]  # the same

    @property
    def peers(self) -> Collection[int]:
        return getattr(self._bus, "peers", ())

    def waiting(self) -> Iterator[bytearray]:
        burst = self._receive()
        if burst:
            yield burst

    def send(self, frames: bytes) -> None:
        self._send(frames, self._timeout_s)


class _SocketBus:
    """SocketCAN, whose socket transfers exactly these bytes, a batch of frames a call.

    Frames that its receive queue had no room for are reported as an error frame, as an adapter does it.
    """

    more = False
    peers: Collection[int] = ()

    def __init__(self, sock: socket.socket, timeouts: SendTimeouts) -> None:
        self._socket, self._timeout_s = BatchSocket(sock), timeouts.queue_s

    def waiting(self) -> Iterator[bytearray]:
        while burst := self._socket.receive():
            if self._socket.lost:
                yield bytearray(overrun_frame(self._socket.lost))
            yield burst
            if len(burst) < MOST_BYTES:
                return  # later frames make the file readable again

    def send(self, frames: bytes) -> None:
        left = frames
        while left:
            left = left[FRAME_BYTES * _with_retries(self._socket.send, left[:MOST_BYTES], self._timeout_s) :]


class _MessageBus:
    """Any other interface, with a message object for each frame."""

    more = False
    peers: Collection[int] = ()

    def __init__(self, bus: can.BusABC, timeouts: SendTimeouts) -> None:
        self._bus, self._timeouts = bus, timeouts

    def waiting(self) -> Iterator[bytearray]:
        while (message := self._bus.recv(0)) is not None:
            yield bytearray(_packed(message))

    def send(self, frames: bytes) -> None:
        for start in range(0, len(frames), FRAME_BYTES):
            _with_retries(self._send_one, frames[start : start + FRAME_BYTES], self._timeouts.queue_s)

    def _send_one(self, frame: bytes) -> None:
        can_id, size, data = FRAME.unpack(frame)
        message = can.Message(arbitration_id=can_id, data=data[:size], is_extended_id=False)
        self._bus.send(message, self._timeouts.interface_s)


def _packed(message: can.Message) -> bytes:
    """Pack a message; a CAN FD message, unused by CANopen, becomes an extended frame without data."""
    header = message.arbitration_id & IDENTIFIER_MASK
    if message.is_fd:
        return FRAME.pack(header | EXTENDED, 0, b"")
    header |= EXTENDED * message.is_extended_id | REMOTE * message.is_remote_frame
    return FRAME.pack(header | ERROR * message.is_error_frame, len(message.data), message.data)


def _with_retries(send: Callable[[bytes], T], frames: bytes, timeout_s: float) -> T:
    """Send frames, waiting at most `timeout_s` for space in a full transmit queue; return its result."""
    deadline_s = 0.0
    while True:
        try:
            return send(frames)
        except (can.CanError, OSError) as error:
            now_s = time.monotonic()
            deadline_s = deadline_s or now_s + timeout_s
            if error_code(error) not in FULL or now_s > deadline_s:
                raise
            time.sleep(PAUSE_S)


def error_code(error: Exception) -> int:
    """Return the errno of an error of the system or of python-can, 0 without one."""
    return getattr(error, "errno", None) or getattr(error, "error_code", None) or 0
