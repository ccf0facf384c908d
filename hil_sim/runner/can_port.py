"""The simulator's CAN port: python-can, opened from `INTERFACE:CHANNEL`, read without threads."""

from collections.abc import Callable
from typing import Any

from can_frames.frame import (
    DATA_AT,
    ERROR,
    FRAME_BYTES,
    HEADER,
    IDENTIFIER_MASK,
    LARGEST_STANDARD,
    REMOTE,
    pack_frame,
)
from can_frames.frame_bus import Patience, frame_bus
from kernels.lean_import import as_if_absent

with as_if_absent("asammdf"):  # python-can loads it for MF4 logs, and pandas with it: 0.5 s of every start
    import can

PATIENCE = Patience(queue_s=1.0, interface_s=1.0)
"""How long a full transmit queue may stay full before the bus counts as lost (chosen).

An adapter's queue holds ten frames, a block of an SDO upload has 127.
"""
CONTROLLER_PROBLEM, BUS_OFF, RESTARTED = 0x004, 0x040, 0x100  # classes of error frames
OVERRUN, ERROR_ACTIVE = 0x03, 0x40  # in byte 1 of the first: receive, transmit; on the bus again
FRAMES_PER_WAKE = 256
"""Bounds the frames read at once, so that timers and signals are served on a busy bus (chosen)."""
RECEIVED_IDENTIFIERS: can.typechecking.CanFilters = [  # 000h to 77Fh, in four prefixes, and LSS
    {"can_id": can_id, "can_mask": can_mask, "extended": False}
    for can_id, can_mask in ((0x000, 0x400), (0x400, 0x600), (0x600, 0x700), (0x700, 0x780), (0x7E5, 0x7FF))
]
"""Identifiers that a node may be configured to receive (see `identifiers`); adapter or hub drop others.

Not only those received now: a frame could overtake the filter that follows an SDO or NMT command.
"""


LOCALCAN = "localcan"
SERVE: dict[str, Any] = {"serve": True}
"""What makes our own interface serve the bus in this process, if nobody does so yet."""


Take = Callable[[bytearray, int], int]
"""Serves frames of a burst from a byte on; returns where one begins that it leaves to others."""


class BusError(Exception):
    """The bus cannot be opened or used. `str()` is one line for the user."""


def open_bus(address: str) -> can.BusABC:
    """Open a bus, for example `socketcan:vcan0` or `localcan:/tmp/bus.sock`.

    One of localcan is served in this process where nobody serves it yet.

    Raises:
        BusError: the address is malformed, the interface unknown, or the bus not there.
    """
    interface, separator, channel = address.partition(":")
    if not separator or not interface or not channel:
        raise BusError(f"bus {address!r}: give INTERFACE:CHANNEL, for example socketcan:vcan0")
    try:
        return can.Bus(
            interface=interface,
            channel=channel,
            receive_own_messages=False,
            can_filters=RECEIVED_IDENTIFIERS,
            **(SERVE if interface == LOCALCAN else {}),
        )
    except (can.CanError, OSError, ValueError, ImportError, NotImplementedError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise BusError(f"bus {address!r} cannot be opened: {reason}") from error


class CanPort:
    """Standard frames of a bus; calls `on_overrun` when some are lost, `on_remote` at a remote one.

    After bus-off nothing is sent or taken until the interface is restarted, which `on_restart` is called at.
    """

    def __init__(self, bus: can.BusABC) -> None:
        self._bus, self._frames = bus, frame_bus(bus, PATIENCE)
        self.on_overrun: Callable[[], None] = lambda: None
        self.on_remote: Callable[[int], None] = lambda _can_id: None
        self.on_restart: Callable[[], None] = lambda: None
        self._off = False
        self._burst: list[bytes] = []

    @property
    def serves(self) -> bool:
        """Whether others reach the bus through this process."""
        return bool(getattr(self._bus, "serves", False))

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()

    def fileno(self) -> int:
        """Descriptor to wait on. Raises BusError if the interface has none."""
        try:
            descriptor = self._bus.fileno()
        except NotImplementedError:
            descriptor = -1
        if descriptor < 0:
            raise BusError(f"bus {self._bus.channel_info}: this interface cannot be waited on")
        return descriptor

    @property
    def more(self) -> bool:
        """Whether frames wait that make the descriptor readable no more."""
        return self._frames.more

    def send(self, can_id: int, data: bytes) -> None:
        """Send a frame with the next `flush`."""
        self._burst.append(pack_frame(can_id, data))

    def send_burst(self, frames: bytes) -> None:
        """Send frames that lie one behind the other with the next `flush`."""
        self._burst.append(frames)

    def flush(self) -> None:
        """Send what has come together; wait a bounded time for room. Raises BusError when it is refused."""
        if not self._burst:
            return
        burst = b"".join(self._burst)
        self._burst.clear()
        if self._off:
            return
        try:
            self._frames.send(burst)
        except (can.CanError, OSError) as error:
            raise BusError(f"bus {self._bus.channel_info}: {error}") from error

    def drain(self, handle: Callable[[int, bytes], None], take: Take | None = None) -> None:
        """Pass what has come to `take`, and what it leaves to `handle`; FRAMES_PER_WAKE or one burst more.

        Raises:
            BusError: the bus is lost.
        """
        taken = 0
        try:
            for burst in self._frames.waiting():
                self._dispatch(burst, handle, take)
                taken += len(burst) // FRAME_BYTES
                if taken >= FRAMES_PER_WAKE:
                    break
        except (can.CanError, OSError) as error:
            raise BusError(f"bus {self._bus.channel_info}: {error}") from error

    def _dispatch(self, burst: bytearray, handle: Callable[[int, bytes], None], take: Take | None) -> None:
        at = 0
        while at < len(burst):
            if take is not None and not self._off:
                at = take(burst, at)
            if at < len(burst):
                self._dispatch_one(burst, at, handle)
                at += FRAME_BYTES

    def _dispatch_one(self, burst: bytearray, start: int, handle: Callable[[int, bytes], None]) -> None:
        header, size = HEADER.unpack_from(burst, start)
        data = bytes(burst[start + DATA_AT : start + DATA_AT + size])
        if header & ERROR:
            self._take_error(header & IDENTIFIER_MASK, data)
        elif self._off:
            return
        elif header <= LARGEST_STANDARD:
            handle(header, data)
        elif header ^ REMOTE <= LARGEST_STANDARD:
            self.on_remote(header ^ REMOTE)

    def _take_error(self, error_class: int, data: bytes) -> None:
        """Follow an error frame (SocketCAN's layout): frames were lost, or the interface is off the bus."""
        flags = data[1] if error_class & CONTROLLER_PROBLEM and len(data) > 1 else 0
        if flags & OVERRUN:
            self.on_overrun()
        if error_class & BUS_OFF:
            self._off = True
        elif self._off and (error_class & RESTARTED or flags & ERROR_ACTIVE):
            self._off = False
            self.on_restart()
