"""One client of the local socket: checks its requests, and bounds the data that waits for it.

Callbacks in the cycle's thread execute each request at its arrival, between two frames of the bus. A client
with more than `BUFFER_LIMIT` unread bytes gets no rows, states or reversals, and its requests wait.
"""

import asyncio
import logging
import os
import socket
import struct
from collections.abc import Callable
from typing import cast

from servo_ctrl.commands.client_activity import ClientActivity
from servo_ctrl.commands.local_frames import FRAME, JSON, REQUEST_LIMIT, frame, rows_frame
from servo_ctrl.telemetry.local_socket.requests import LocalRequests
from servo_ctrl.telemetry.local_socket.rows import RowBuffer
from servo_ctrl.telemetry.local_socket.status import with_missed

BUFFER_LIMIT = 1 << 19
"""Bounds a client's unread bytes, besides the kernel's buffer; chosen: more than a second of rows."""
MALFORMED_LIMIT = 3
"""Malformed messages after which a client is disconnected; chosen."""
LINGER_S = 1.0
"""Time for a client to read why it is disconnected; chosen."""
REQUESTS_AT_ONCE = 16
PAUSE_S = 0.02
"""After `REQUESTS_AT_ONCE` consecutive requests a client pauses this long, for the cycle; chosen."""
_CREDENTIALS = struct.Struct("3i")  # pid, uid, gid

_LOG = logging.getLogger(__name__)


class LocalClient(asyncio.Protocol):
    """Sends `hello` first; `join` and `leave` keep the list of clients."""

    def __init__(
        self,
        hello: bytes,
        requests: LocalRequests,
        rows: RowBuffer,
        join: Callable[["LocalClient"], bool],
        leave: Callable[["LocalClient"], None],
    ) -> None:
        self.missed = 0
        """Rows that this client did not get."""
        self._hello, self._requests, self._rows = hello, requests, rows
        self._join, self._leave = join, leave
        self._transport: asyncio.Transport | None = None
        self._received = bytearray()
        self._next = rows.end
        self._malformed = 0
        self._full = self._paused = False
        self._activity = ClientActivity()

    @property
    def unread(self) -> int:
        """Bytes that wait for the client in this process."""
        return self._transport.get_write_buffer_size() if self._transport is not None else 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Send `hello`, or refuse a client of another user than the controller's."""
        self._transport = cast("asyncio.Transport", transport)
        self._transport.set_write_buffer_limits(high=BUFFER_LIMIT)
        uid = peer_uid(transport.get_extra_info("socket"))
        if uid != os.geteuid():
            _LOG.warning("local socket: user %d was refused", uid)
            self._transport.abort()
        elif not self._join(self):
            _LOG.warning("local socket: too many clients, another one was refused")
            self._transport.abort()
        else:
            self._transport.write(frame(JSON, self._hello))

    def connection_lost(self, exc: Exception | None) -> None:
        """Leave the list of clients; end the motion that only this client waits for."""
        del exc
        self._transport = None
        self._activity.disconnected = True
        self._leave(self)

    def pause_writing(self) -> None:
        """Send no more, because more than `BUFFER_LIMIT` bytes are unread."""
        self._full = True

    def resume_writing(self) -> None:
        """Send again, because the client has read its bytes."""
        self._full = False
        self._serve()

    def data_received(self, data: bytes) -> None:
        """Execute the complete requests."""
        self._received += data
        self._serve()

    def send_rows(self) -> None:
        """Send the rows since the last call."""
        if self._transport is None or self._full:
            return
        first, rows, values = self._rows.since(self._next)
        self.missed += first - self._next
        self._next = first + rows
        if rows:
            self._transport.write(rows_frame(first, self.missed, rows, values))

    def send_status(self, status: bytes) -> None:
        """Send a status of `StatusEncoder`, completed with this client's missed rows."""
        self.send(with_missed(status, self.missed))

    def send(self, message: bytes) -> None:
        """Send a message, unless too many bytes are unread."""
        if self._transport is not None and not self._full:
            self._transport.write(frame(JSON, message))

    def close(self) -> None:
        """End the connection once everything is sent."""
        if self._transport is not None:
            self._transport.close()

    def abort(self) -> None:
        """End the connection at once."""
        if self._transport is not None:
            self._transport.abort()

    def _serve(self) -> None:
        """Execute the received requests, `REQUESTS_AT_ONCE` at a time."""
        try:
            for _ in range(REQUESTS_AT_ONCE):
                if self._transport is None or self._full or self._paused or not self._serve_one():
                    break
            else:
                self._paused = True
                asyncio.get_running_loop().call_later(PAUSE_S, self._resume)
        except Exception:  # noqa: BLE001  # a bug must not stop the machine, only the connection
            _LOG.exception("local socket: internal error")
            self.abort()
        if self._transport is not None and not self._transport.is_closing():
            # execute the requests in the buffer before reading more
            if self._full or self._paused:
                self._transport.pause_reading()
            else:
                self._transport.resume_reading()

    def _serve_one(self) -> bool:
        """Execute the first request; return False when it is incomplete."""
        if len(self._received) < FRAME.size:
            return False
        kind, length = FRAME.unpack_from(self._received)
        if kind != JSON or length > REQUEST_LIMIT:
            what = f"{length} bytes, over {REQUEST_LIMIT}" if kind == JSON else f"kind {kind!r}, not J"
            self._refuse(self._requests.malformed(f"a frame of {what}"), final=True)
            return False
        end = FRAME.size + length
        if len(self._received) < end:
            return False
        payload = bytes(self._received[FRAME.size : end])
        del self._received[:end]
        request = self._requests.read(payload)
        if isinstance(request, bytes):
            self._malformed += 1
            self._refuse(request, final=self._malformed >= MALFORMED_LIMIT)
        else:
            self._requests.carry_out(request, self._answer, self._activity)
        return True

    def _refuse(self, answer: bytes, *, final: bool) -> None:
        self._answer(answer)
        if final:
            _LOG.warning("local socket: a client that sends no requests was disconnected")
            self._received.clear()
            self.close()
            asyncio.get_running_loop().call_later(LINGER_S, self.abort)

    def _answer(self, answer: bytes) -> None:
        if self._transport is not None and not self._transport.is_closing():
            self._transport.write(frame(JSON, answer))

    def _resume(self) -> None:
        self._paused = False
        self._serve()


def peer_uid(connection: socket.socket) -> int:
    """Return the user id of the peer, from the kernel."""
    _pid, uid, _gid = _CREDENTIALS.unpack(
        connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    )
    return int(uid)
