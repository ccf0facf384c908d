"""The simulator's CAN port: python-can, opened from `INTERFACE:CHANNEL`, read without threads."""

from collections.abc import Callable, Collection
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
from can_frames.frame_bus import SendTimeouts, frame_bus
from kernels.lean_import import as_if_absent

with as_if_absent("asammdf"):  # python-can loads it for MF4 logs, and pandas with it: 0.5 s of every start
    import can

SEND_TIMEOUTS = SendTimeouts(queue_s=1.0, interface_s=1.0)
"""Longest time that a transmit queue may stay full before the bus counts as lost (chosen).

An adapter's queue holds ten frames, a block of an SDO upload has 127.
"""
CONTROLLER_PROBLEM, BUS_OFF, RESTARTED = 0x004, 0x040, 0x100  # classes of error frames
OVERRUN, ERROR_ACTIVE = 0x03, 0x40  # byte 1 of a controller problem: overflow; active again
FRAMES_PER_WAKE = 256
"""Bounds the frames read at once, so that a busy bus does not keep timers and signals waiting (chosen)."""
RECEIVED_IDENTIFIERS: can.typechecking.CanFilters = [  # 000h to 77Fh, in four prefixes, and LSS
    {"can_id": can_id, "can_mask": can_mask, "extended": False}
    for can_id, can_mask in ((0x000, 0x400), (0x400, 0x600), (0x600, 0x700), (0x700, 0x780), (0x7E5, 0x7FF))
]
"""Identifiers that a node may be configured to receive (see `identifiers`); adapter or hub drop the others.

The filter does not follow the present configuration, because a frame could overtake a change of it.
"""
LOCALCAN = "localcan"
SERVE: dict[str, Any] = {"serve": True}
"""Option of our own interface: serve the bus in this process unless another process serves it."""

ServeBurst = Callable[[bytearray, int], int]
"""Serves frames of a burst from a byte on; returns the start of a frame that it does not serve."""


class BusError(Exception):
    """The bus cannot be opened or used. `str()` is one line for the user."""


def open_bus(address: str) -> can.BusABC:
    """Open a bus, for example `socketcan:vcan0` or `localcan:/tmp/bus.sock`.

    This process serves a localcan bus that no other process serves.

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
    """Sends and receives the standard frames of a bus.

    Calls `on_remote(can_id)` at a remote frame, `on_overrun()` when frames are lost, and `on_restart()` when
    the interface returns after bus-off; meanwhile it sends and receives nothing.
    """

    def __init__(self, bus: can.BusABC) -> None:
        self._bus, self._frames = bus, frame_bus(bus, SEND_TIMEOUTS)
        self.on_overrun: Callable[[], None] = lambda: None
        self.on_remote: Callable[[int], None] = lambda _can_id: None
        self.on_restart: Callable[[], None] = lambda: None
        self._off = False
        self._burst: list[bytes] = []

    @property
    def serves(self) -> bool:
        """Whether this process serves the bus to others."""
        return bool(getattr(self._bus, "serves", False))

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()

    def fileno(self) -> int:
        """Return the descriptor to wait on. Raises BusError if the interface has none."""
        try:
            descriptor = self._bus.fileno()
        except NotImplementedError:
            descriptor = -1
        if descriptor < 0:
            raise BusError(f"bus {self._bus.channel_info}: this interface cannot be waited on")
        return descriptor

    @property
    def more(self) -> bool:
        """Whether received frames wait in a buffer, for which the descriptor does not become readable."""
        return self._frames.more

    def peers(self) -> Collection[int]:
        """Return process ids at the other end of the bus; empty if the interface does not know them."""
        return self._frames.peers

    def send(self, can_id: int, data: bytes) -> None:
        """Queue a frame for the next `flush`."""
        self._burst.append(pack_frame(can_id, data))

    def send_burst(self, frames: bytes) -> None:
        """Queue consecutive packed frames for the next `flush`."""
        self._burst.append(frames)

    def flush(self) -> None:
        """Send the queued frames, with a bounded wait for space. Raises BusError if the bus is lost."""
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

    def drain(self, handle: Callable[[int, bytes], None], serve: ServeBurst | None = None) -> int:
        """Pass received frames to `serve`, the others to `handle`, until FRAMES_PER_WAKE or none waits.

        Returns the number of frames.

        Raises:
            BusError: the bus is lost.
        """
        handled = 0
        try:
            for burst in self._frames.waiting():
                self._dispatch(burst, handle, serve)
                handled += len(burst) // FRAME_BYTES
                if handled >= FRAMES_PER_WAKE:
                    break
        except (can.CanError, OSError) as error:
            raise BusError(f"bus {self._bus.channel_info}: {error}") from error
        return handled

    def _dispatch(
        self, burst: bytearray, handle: Callable[[int, bytes], None], serve: ServeBurst | None
    ) -> None:
        at = 0
        while at < len(burst):
            if serve is not None and not self._off:
                at = serve(burst, at)
            if at < len(burst):
                self._dispatch_one(burst, at, handle)
                at += FRAME_BYTES

    def _dispatch_one(self, burst: bytearray, start: int, handle: Callable[[int, bytes], None]) -> None:
        header, size = HEADER.unpack_from(burst, start)
        data = bytes(burst[start + DATA_AT : start + DATA_AT + size])
        if header & ERROR:
            self._on_error_frame(header & IDENTIFIER_MASK, data)
        elif self._off:
            return
        elif header <= LARGEST_STANDARD:
            handle(header, data)
        elif header ^ REMOTE <= LARGEST_STANDARD:
            self.on_remote(header ^ REMOTE)

    def _on_error_frame(self, error_class: int, data: bytes) -> None:
        """Act on an error frame (SocketCAN's layout): lost frames, bus-off, or the return from it."""
        flags = data[1] if error_class & CONTROLLER_PROBLEM and len(data) > 1 else 0
        if flags & OVERRUN:
            self.on_overrun()
        if error_class & BUS_OFF:
            self._off = True
        elif self._off and (error_class & RESTARTED or flags & ERROR_ACTIVE):
            self._off = False
            self.on_restart()
