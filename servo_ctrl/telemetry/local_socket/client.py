"""One client of the local socket: what it sends is checked, what it does not read is not kept for it.

Callbacks only, in the thread of the cycle: a request is carried out as it arrives, between two frames of the
bus. Beyond `BUFFER_LIMIT` bytes that a client has not read, it gets no more rows, states or reversals, and
its requests wait.
"""

from __future__ import annotations

import asyncio
import logging
import os
import socket
import struct
from collections.abc import Callable
from typing import cast

from servo_ctrl.commands.local_frames import FRAME, JSON, REQUEST_LIMIT, frame, rows_frame
from servo_ctrl.telemetry.local_socket.requests import LocalRequests
from servo_ctrl.telemetry.local_socket.rows import RowBuffer
from servo_ctrl.telemetry.local_socket.status import with_missed

BUFFER_LIMIT = 1 << 19
"""Bytes that a client may leave unread, beside what the kernel keeps."""
MALFORMED_LIMIT = 3
"""Messages that are no requests; then the client is sent away."""
FAREWELL_S = 1.0
"""For who is sent away, to read why."""
REQUESTS_AT_ONCE = 16
REST_S = 0.02
"""After so many requests at one go a client has to wait, and the cycle is served."""
_CREDENTIALS = struct.Struct("3i")  # pid, uid, gid

_LOG = logging.getLogger(__name__)


class LocalClient(asyncio.Protocol):
    """`hello` is what it gets first; `join` and `leave` keep the list of clients."""

    def __init__(
        self,
        hello: bytes,
        requests: LocalRequests,
        rows: RowBuffer,
        join: Callable[[LocalClient], bool],
        leave: Callable[[LocalClient], None],
    ) -> None:
        self.missed = 0
        """Rows it did not get."""
        self._hello, self._requests, self._rows = hello, requests, rows
        self._join, self._leave = join, leave
        self._transport: asyncio.Transport | None = None
        self._received = bytearray()
        self._next = rows.end
        self._malformed = 0
        self._full = self._resting = False

    @property
    def unread(self) -> int:
        """Bytes that wait for it here."""
        return self._transport.get_write_buffer_size() if self._transport is not None else 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Somebody has connected: only whoever the controller itself runs as may stay."""
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
        """It has gone."""
        del exc
        self._transport = None
        self._leave(self)

    def pause_writing(self) -> None:
        """It does not read."""
        self._full = True

    def resume_writing(self) -> None:
        """It reads again."""
        self._full = False
        self._serve()

    def data_received(self, data: bytes) -> None:
        """It asks for something."""
        self._received += data
        self._serve()

    def send_rows(self) -> None:
        """The rows since the last ones."""
        if self._transport is None or self._full:
            return
        first, rows, values = self._rows.since(self._next)
        self.missed += first - self._next
        self._next = first + rows
        if rows:
            self._transport.write(rows_frame(first, self.missed, rows, values))

    def send_status(self, status: bytes) -> None:
        """How things are; not closed yet, see `StatusEncoder`."""
        self.send(with_missed(status, self.missed))

    def send(self, message: bytes) -> None:
        """Something that a client that does not read can miss."""
        if self._transport is not None and not self._full:
            self._transport.write(frame(JSON, message))

    def close(self) -> None:
        """Send what is waiting, then end."""
        if self._transport is not None:
            self._transport.close()

    def abort(self) -> None:
        """End at once."""
        if self._transport is not None:
            self._transport.abort()

    def _serve(self) -> None:
        """Carry out what has arrived, a few at a time."""
        try:
            for _ in range(REQUESTS_AT_ONCE):
                if self._transport is None or self._full or self._resting or not self._serve_one():
                    break
            else:
                self._rest()
        except Exception:  # noqa: BLE001  # a mistake of ours costs the connection, not the machine
            _LOG.exception("local socket: internal error")
            self.abort()
        if self._transport is not None and not self._transport.is_closing():
            # what is in the buffer already has to be served before more is read
            if self._full or self._resting:
                self._transport.pause_reading()
            else:
                self._transport.resume_reading()

    def _serve_one(self) -> bool:
        """The first of what has arrived; False when it is not whole yet."""
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
            self._requests.carry_out(request, self._answer)
        return True

    def _refuse(self, answer: bytes, *, final: bool) -> None:
        self._answer(answer)
        if final:
            _LOG.warning("local socket: a client that sends no requests was sent away")
            self._received.clear()
            self.close()
            asyncio.get_running_loop().call_later(FAREWELL_S, self.abort)

    def _answer(self, answer: bytes) -> None:
        if self._transport is not None and not self._transport.is_closing():
            self._transport.write(frame(JSON, answer))

    def _rest(self) -> None:
        self._resting = True
        asyncio.get_running_loop().call_later(REST_S, self._go_on)

    def _go_on(self) -> None:
        self._resting = False
        self._serve()


def peer_uid(connection: socket.socket) -> int:
    """The user at the other end, as the kernel knows it."""
    _pid, uid, _gid = _CREDENTIALS.unpack(
        connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    )
    return int(uid)
