"""Shared by the fuzz targets of the bus: SocketCAN frames (16 bytes each), and a bus that delivers them."""

from collections.abc import Sequence

import can

from local_can import wire

MOST_FRAMES = 400
SDO_WORDS = tuple(
    bytes.fromhex(text) for text in ("40", "4f", "41", "60", "00", "20", "80", "a0", "c0", "c2", "c6")
)


def framed(*frames: tuple[int, bytes]) -> bytes:
    """Return frames in the wire format of localcan."""
    return b"".join(wire.FRAME.pack(can_id, len(data), 0, data) for can_id, data in frames)


def messages(data: bytes) -> list[can.Message]:
    """Convert frames with any flags and lengths up to 64 to messages of python-can."""
    converted = []
    for header, length, _, payload in wire.FRAME.iter_unpack(
        data[: len(data) // 16 * 16][: 16 * MOST_FRAMES]
    ):
        remote, fd = bool(header & wire.REMOTE), length > 8
        size = min(length, 64)
        converted.append(
            can.Message(
                arbitration_id=header & wire.EXTENDED_ID_MASK if header & wire.EXTENDED else header & 0x7FF,
                is_extended_id=bool(header & wire.EXTENDED),
                is_remote_frame=remote and not fd,
                is_error_frame=bool(header & wire.ERROR),
                is_fd=fd,
                dlc=size,
                data=b"" if remote and not fd else (payload * 8)[:size],
            )
        )
    return converted


class ScriptedBus:
    """A python-can bus that delivers given messages and counts those that are sent."""

    channel_info = "fuzz"

    def __init__(self, waiting: list[can.Message]) -> None:
        self._waiting = waiting[::-1]
        self.sent = 0

    def recv(self, _timeout: float) -> can.Message | None:
        return self._waiting.pop() if self._waiting else None

    def send(self, _message: can.Message, _timeout: float | None = None) -> None:
        self.sent += 1

    def __len__(self) -> int:
        return len(self._waiting)


def traffic() -> Sequence[bytes]:
    """Return seeds: the traffic of a bus with a machine on it."""
    inputs = [(0x181, bytes(8)), (0x18B, bytes(4)), (0x182, bytes(8)), (0x18C, bytes(4))]
    services = [
        (0x701, b"\x05"),
        (0x081, b"\x11\x86\x20\0\0\0\0\0"),
        (0x70B, b"\0"),
        (0x67F, b"\x40\0\x10\0\0\0\0\0"),
    ]
    foreign = [(0x80, b""), (0x201, bytes(7)), (0x77F, b"\x05"), (wire.ERROR | 0x04, b"\0\1\0\0\0\0\0\7")]
    return [framed(*inputs, *services), framed(*inputs, *foreign), framed((wire.EXTENDED | 0x181, bytes(8)))]
