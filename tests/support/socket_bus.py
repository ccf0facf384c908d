"""A socket pair as a python-can bus, the other end of which is the test."""

import socket
import struct

import can

ERROR_FLAG = 0x2000_0000
EXTENDED_FLAG = 0x8000_0000
_FRAME = struct.Struct("=IB3x8s")


class SocketBus(can.BusABC):
    """One end of a socket pair as a bus; the other end is the test."""

    def __init__(self) -> None:
        super().__init__(channel="pair")
        self.near, self.far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.near.setblocking(False)

    def fileno(self) -> int:
        return self.near.fileno()

    def recv(self, timeout: float | None = None) -> can.Message | None:  # noqa: ARG002  # python-can's signature
        try:
            raw = self.near.recv(_FRAME.size)
        except BlockingIOError:
            return None
        if not raw:
            raise can.CanOperationError("the other end has gone")
        header, size, data = _FRAME.unpack(raw)
        return can.Message(
            arbitration_id=header & ~(ERROR_FLAG | EXTENDED_FLAG),
            data=data[:size],
            is_extended_id=bool(header & EXTENDED_FLAG),
            is_error_frame=bool(header & ERROR_FLAG),
        )

    def send(self, msg: can.Message, timeout: float | None = None) -> None:  # noqa: ARG002  # python-can's signature
        try:
            self.near.send(_FRAME.pack(msg.arbitration_id, msg.dlc, bytes(msg.data)))
        except OSError as error:
            raise can.CanOperationError(str(error)) from error

    def shutdown(self) -> None:
        super().shutdown()
        self.near.close()

    def put(self, can_id: int, data: bytes = b"") -> None:
        """Send a frame from the other end."""
        self.far.send(_FRAME.pack(can_id, len(data), data))

    def take_sent(self) -> tuple[int, bytes]:
        """Return a frame that the bus sent to the other end."""
        header, size, data = _FRAME.unpack(self.far.recv(_FRAME.size))
        return header, data[:size]
