"""The simulator's CAN port: python-can, opened from `INTERFACE:CHANNEL`, read without threads."""

import errno
import time
from collections.abc import Callable

from kernels.lean_import import as_if_absent

with as_if_absent("asammdf"):  # python-can loads it for MF4 logs, and pandas with it: 0.5 s of every start
    import can

SEND_TIMEOUT_S = 1.0
"""How long a full transmit queue may stay full before the bus counts as lost (chosen)."""
FRAME_S = 130e-6
"""The longest frame at 1 Mbit/s, 8 bytes and its stuff bits."""
CONTROLLER_PROBLEM = 0x004  # class of an error frame
OVERRUN = 0x03  # in its byte 1: receive, transmit
FRAMES_PER_WAKE = 256
"""Bounds the frames read at once, so that timers and signals are served on a busy bus (chosen)."""
RECEIVED_IDENTIFIERS: can.typechecking.CanFilters = [  # 000h to 77Fh, in four prefixes
    {"can_id": can_id, "can_mask": can_mask, "extended": False}
    for can_id, can_mask in ((0x000, 0x400), (0x400, 0x600), (0x600, 0x700), (0x700, 0x780))
]
"""Identifiers that a node may be configured to receive (see `identifiers`); adapter or hub drop others.

Not only those received now: a frame could overtake the filter that follows an SDO or NMT command.
"""


class BusError(Exception):
    """The bus cannot be opened or used. `str()` is one line for the user."""


def open_bus(address: str) -> can.BusABC:
    """Open a bus, for example `socketcan:vcan0` or `localcan:/tmp/bus.sock`.

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
        )
    except (can.CanError, OSError, ValueError, ImportError, NotImplementedError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise BusError(f"bus {address!r} cannot be opened: {reason}") from error


class CanPort:
    """Sends and receives standard data frames; calls `on_overrun` when frames were lost."""

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus
        self.on_overrun: Callable[[], None] = lambda: None
        self._messages: dict[int, can.Message] = {}  # reused: a send has copied the frame when it returns

    def fileno(self) -> int:
        """Descriptor to wait on. Raises BusError if the interface has none."""
        try:
            descriptor = self._bus.fileno()
        except NotImplementedError:
            descriptor = -1
        if descriptor < 0:
            raise BusError(f"bus {self._bus.channel_info}: this interface cannot be waited on")
        return descriptor

    def send(self, can_id: int, data: bytes) -> None:
        """Send one frame; wait up to SEND_TIMEOUT_S for room. Raises BusError when the bus refuses it."""
        message = self._messages.get(can_id)
        if message is None:
            message = self._messages[can_id] = can.Message(arbitration_id=can_id, is_extended_id=False)
        message.data = data  # type: ignore[assignment]  # senders only read it
        message.dlc = len(data)
        deadline_s = None
        while True:
            try:
                self._bus.send(message, SEND_TIMEOUT_S)
            except can.CanError as error:
                deadline_s = deadline_s or time.monotonic() + SEND_TIMEOUT_S
                if error.error_code != errno.ENOBUFS or time.monotonic() > deadline_s:
                    raise BusError(f"bus {self._bus.channel_info}: {error}") from error
                time.sleep(FRAME_S)  # an adapter's queue holds ten frames, a block of an SDO upload has 127
            else:
                return

    def drain(self, handle: Callable[[int, bytes], None]) -> None:
        """Pass FRAMES_PER_WAKE received frames at most to `handle`. Raises BusError when the bus is lost."""
        receive = self._bus.recv
        try:
            for _ in range(FRAMES_PER_WAKE):
                message = receive(0)
                if message is None:
                    return
                if message.is_error_frame:
                    self._check_overrun(message)
                elif not (message.is_extended_id or message.is_remote_frame or message.is_fd):
                    handle(message.arbitration_id, bytes(message.data))
        except can.CanError as error:
            raise BusError(f"bus {self._bus.channel_info}: {error}") from error

    def _check_overrun(self, message: can.Message) -> None:
        """Call `on_overrun` where an error frame (SocketCAN's layout) reports an overrun."""
        flags = message.data[1] if len(message.data) > 1 else 0
        if message.arbitration_id & CONTROLLER_PROBLEM and flags & OVERRUN:
            self.on_overrun()
