"""Moves several messages of a socket in one system call, recvmmsg(2) or sendmmsg(2), absent in `socket`.

Each message is a frame of `FRAME_BYTES`; a burst is a sequence of frames in memory.
"""

import ctypes
import os
import socket
import struct

from can_frames.frame import FRAME_BYTES

MOST_FRAMES = 64
"""Bounds the frames of a call; chosen: the number that the controller's port reads between timers."""

TIMESTAMPS, COUNT_LOST = 35, 40
"""`SO_TIMESTAMPNS`, which python-can switches on and nobody reads here, and `SO_RXQ_OVFL`."""
LOST = struct.Struct("@LiiI0L")
"""`struct cmsghdr` of `SO_RXQ_OVFL` and its number: frames lost since the socket was opened, modulo 2^32."""


class _Span(ctypes.Structure):
    """`struct iovec`."""

    _fields_ = (("base", ctypes.c_void_p), ("size", ctypes.c_size_t))


class _Header(ctypes.Structure):
    """`struct msghdr`."""

    _fields_ = (
        ("name", ctypes.c_void_p),
        ("name_size", ctypes.c_uint),
        ("spans", ctypes.POINTER(_Span)),
        ("span_count", ctypes.c_size_t),
        ("control", ctypes.c_void_p),
        ("control_size", ctypes.c_size_t),
        ("flags", ctypes.c_int),
    )


class _Message(ctypes.Structure):
    """`struct mmsghdr`, with the number of bytes that the call has moved."""

    _fields_ = (("header", _Header), ("moved", ctypes.c_uint))


class MessageBatch:
    """Memory for `MOST_FRAMES` messages of a socket, and the system call that fills or sends it.

    Raises:
        AttributeError: the C library has no such call.
    """

    def __init__(self, sock: socket.socket, call: str) -> None:
        library = ctypes.PyDLL(None, use_errno=True)  # keeps the interpreter lock: the call never waits
        self._call = getattr(library, call)
        self._call.argtypes = (
            *(ctypes.c_int, ctypes.c_void_p, ctypes.c_uint, ctypes.c_int),
            *((ctypes.c_void_p,) if call == "recvmmsg" else ()),
        )
        self._rest = (None,) if call == "recvmmsg" else ()
        self._sock = sock
        self.memory = (ctypes.c_char * (FRAME_BYTES * MOST_FRAMES))()
        """The frames in sequence."""
        begin = ctypes.addressof(self.memory)
        self._spans = (_Span * MOST_FRAMES)(
            *(_Span(begin + FRAME_BYTES * place, FRAME_BYTES) for place in range(MOST_FRAMES))
        )
        self._messages = (_Message * MOST_FRAMES)()
        for message, span in zip(self._messages, self._spans, strict=True):
            message.header.spans, message.header.span_count = ctypes.pointer(span), 1
        self._begin = ctypes.addressof(self._messages)
        self.first = self._messages[0].header

    def move(self, count: int) -> int:
        """Move at most `count` messages without waiting; return how many were moved. Raises OSError."""
        moved: int = self._call(self._sock.fileno(), self._begin, count, socket.MSG_DONTWAIT, *self._rest)
        if moved < 0:
            code = ctypes.get_errno()
            raise OSError(code, os.strerror(code))
        return moved


class BatchSocket:
    """Sends and receives frames of a socket, as many as possible a system call."""

    def __init__(self, sock: socket.socket) -> None:
        self._received, self._sent = MessageBatch(sock, "recvmmsg"), MessageBatch(sock, "sendmmsg")
        self._send_one = sock.send
        self.lost = 0
        """Frames for which the receive queue had no room, reported with the last `receive`."""
        self._lost_so_far = 0
        sock.setsockopt(socket.SOL_SOCKET, TIMESTAMPS, 0)  # a message carries the one number that is read
        sock.setsockopt(socket.SOL_SOCKET, COUNT_LOST, 1)
        self._control = ctypes.create_string_buffer(LOST.size)
        self._first = self._received.first
        self._first.control = ctypes.addressof(self._control)

    def receive(self) -> bytearray:
        """Return at most `MOST_FRAMES` received frames; empty if none waits. Raises OSError.

        With each frame the kernel reports how many were lost before it was queued; that of the first is read.
        """
        batch, first = self._received, self._first
        first.control_size = LOST.size
        try:
            count = batch.move(MOST_FRAMES)
        except BlockingIOError:
            return bytearray()
        self.lost = self._newly_lost() if first.control_size else 0
        return bytearray(memoryview(batch.memory)[: FRAME_BYTES * count])

    def _newly_lost(self) -> int:
        lost: int
        _, level, kind, lost = LOST.unpack(self._control.raw)
        if (level, kind) != (socket.SOL_SOCKET, COUNT_LOST):
            return 0
        before, self._lost_so_far = self._lost_so_far, lost
        return (lost - before) % (1 << 32)

    def send(self, frames: bytes) -> int:
        """Send at most `MOST_FRAMES` frames, as many as the queue accepts; return how many.

        One thread may send bursts, any may send a single frame.

        Raises:
            OSError: no frame could be sent; ENOBUFS or EAGAIN means a full queue.
        """
        if len(frames) == FRAME_BYTES:
            self._send_one(frames, socket.MSG_DONTWAIT)
            return 1
        batch = self._sent
        ctypes.memmove(batch.memory, frames, len(frames))
        return batch.move(len(frames) // FRAME_BYTES)
