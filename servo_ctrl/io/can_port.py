"""The controller's only access to the bus: a python-can bus read from the asyncio thread, no reader thread.

A frame goes to the handler registered for its identifier; whatever has none goes to `fallback` (SDO,
NMT and so on, which the canopen library takes). Error frames become one-line events.
"""

import asyncio
import errno
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

from can_frames.frame import (
    DATA_AT,
    ERROR,
    FRAME_BITS,
    FRAME_BYTES,
    HEADER,
    IDENTIFIER_MASK,
    LARGEST_STANDARD,
    pack_frame,
)
from can_frames.frame_bus import Patience, error_code, frame_bus
from kernels.lean_import import as_if_absent
from servo_ctrl.errors import ServoCtrlError

with as_if_absent("asammdf"):  # python-can loads it for MF4 logs, and pandas with it: 0.5 s of every start
    import can

Handler = Callable[[bytearray, float], None]

FRAMES_PER_WAKE = 64
"""Frames taken at once; then timers and signals get their turn on a bus that is never idle. Chosen."""
CATCH_UP_S = 0.005
CATCH_UP_STEPS = 100
"""Bounds `caught_up`; chosen, as its interval above."""
FRAMES_A_STEP = 106
"""As many as a bus of 1 Mbit/s brings in `CATCH_UP_S`; more of them had been queued."""
RESTARTED, ERROR_ACTIVE = 0x100, 0x40
"""By these, a class and a bit of byte 1 of class 4, an interface that was off is on the bus again."""
ERROR_CLASSES: tuple[tuple[int, str], ...] = (
    (RESTARTED, "controller restarted"),
    (0x020, "no acknowledge on transmission"),
    (0x001, "transmission timed out"),
    (0x002, "arbitration lost"),
    (0x008, "protocol violation"),
    (0x010, "transceiver fault"),
)
"""SocketCAN error classes (linux/can/error.h), the most severe first."""
PATIENCE = Patience(queue_s=0.02, interface_s=None)
"""How long a full transmit queue may stay full (chosen); SocketCAN queues ten frames by default."""
SIZE_AT = 4
"""Where a frame has its data length."""
BUS_OFF = 0x040
CONTROLLER_CLASS = 0x004
OVERRUNS = 0x03
CONTROLLER_PROBLEMS: tuple[tuple[int, str], ...] = (
    (0x01, "receive overrun: frames were lost"),
    (0x02, "transmit overrun: frames were lost"),
    (0x30, "error passive"),
    (0x0C, "error warning"),
    (ERROR_ACTIVE, "back to error active"),
)
"""SocketCAN controller problems, byte 1 of an error frame of class 4."""


ADVICE: dict[int, str] = {
    errno.EAFNOSUPPORT: "this kernel has no SocketCAN; use localcan:SOCKET, which `hil-sim run` serves",
    errno.ENODEV: "there is no such interface; `ip link` lists them",
    errno.ENETDOWN: "the interface is down; `ip link set ... up` (with its bitrate) switches it on",
    errno.ENOBUFS: "nobody takes the frames; check that a node is on, the cable, termination and bit rate",
}
"""What to do about errors of SocketCAN that do not say it themselves."""


class BusError(ServoCtrlError):
    """The bus cannot be opened, or it failed during a run."""


class BusNews(NamedTuple):
    """An error frame in words, and what it says of frames and of the interface."""

    text: str
    frames_lost: bool
    down: bool
    """Bus-off: the interface has left the bus until it is restarted."""
    restarted: bool = False
    """It is on the bus again."""


class TxFrame:
    """A frame that is sent again and again with new data."""

    def __init__(self, burst: list[bytes], can_id: int) -> None:
        self._burst, self._can_id = burst, can_id

    def send(self, payload: bytes) -> None:
        """Send `payload` with the port's next `flush`."""
        self._burst.append(pack_frame(self._can_id, payload))


class CanPort:
    """An open bus. `handlers` maps identifiers to callables of (data, timestamp in seconds)."""

    def __init__(self, bus: can.BusABC, name: str) -> None:
        self.name = name
        self.frames = self.bits = 0
        """Sent and received so far, bits as in `FRAME_BITS`."""
        self.handlers: dict[int, Handler] = {}
        self.fallback: Callable[[int, bytearray, float], None] = _ignore
        self.on_error_frame: Callable[[BusNews], None] = _ignore
        self.on_down: Callable[[BusError], None] = _ignore
        self.off = False
        """Bus-off: nothing is sent or taken until the interface says that it was restarted."""
        self._bus, self._frames = bus, frame_bus(bus, PATIENCE)
        self._burst: list[bytes] = []
        """Cyclic frames that the next `flush` sends."""
        self._loop: asyncio.AbstractEventLoop | None = None
        self._fileno = -1

    def attach(self, loop: asyncio.AbstractEventLoop) -> None:
        """Read the bus in this loop from now on. Raises BusError when it has no file descriptor."""
        try:
            self._fileno = self._bus.fileno()
            loop.add_reader(self._fileno, self._drain)
        except (NotImplementedError, OSError, ValueError):
            raise BusError(f"bus {self.name}: this python-can interface has no file to wait on") from None
        self._loop = loop

    async def caught_up(self) -> None:
        """Read until the queued frames are taken: the first inputs behind them would come too late."""
        for _ in range(CATCH_UP_STEPS):
            before = self.frames
            await asyncio.sleep(CATCH_UP_S)
            if self.frames - before <= FRAMES_A_STEP:
                return

    def finish(self) -> None:
        """Take what has arrived, `FRAMES_PER_WAKE` at most, and read no more."""
        taken, before = 0, -1
        while self._loop is not None and before < taken < FRAMES_PER_WAKE:
            before = taken
            taken += self._drain()
        self.detach()

    def detach(self) -> None:
        """Read no more."""
        if self._loop is not None:
            self._loop.remove_reader(self._fileno)
            self._loop = None

    def close(self) -> None:
        """Detach and shut the bus down."""
        self.detach()
        self._bus.shutdown()

    def frame(self, can_id: int) -> TxFrame:
        """Make a frame that is sent every cycle."""
        return TxFrame(self._burst, can_id)

    def flush(self) -> None:
        """Send the cyclic frames in one go. A failure goes to `on_down`."""
        burst = b"".join(self._burst)
        self._burst.clear()
        try:
            self._send(burst)
        except (can.CanError, OSError) as error:
            self.fail(error)

    def send(self, can_id: int, payload: bytes) -> None:
        """Send one frame at once; also from a worker thread. Raises BusError."""
        try:
            self._send(pack_frame(can_id, payload))
        except (can.CanError, OSError) as error:
            raise BusError(f"bus {self.name}: cannot send: {_with_advice(error)}") from None

    def _send(self, burst: bytes) -> None:
        if self.off:
            return
        self.frames += len(burst) // FRAME_BYTES
        for size in burst[SIZE_AT::FRAME_BYTES]:
            self.bits += FRAME_BITS[size]
        self._frames.send(burst)

    def fail(self, error: Exception) -> None:
        """Read no more and call `on_down`, as the bus has failed."""
        self.detach()
        if not isinstance(error, BusError):
            error = BusError(f"bus {self.name} failed: {_with_advice(error)}")
        self.on_down(error)

    def _drain(self) -> int:
        """Take what has come, `FRAMES_PER_WAKE` or one burst more; return how many frames that were."""
        taken = 0
        try:
            for burst in self._frames.waiting():
                self._dispatch(burst)
                taken += len(burst) // FRAME_BYTES
                if taken >= FRAMES_PER_WAKE:
                    break
        except (can.CanError, OSError, BusError) as error:  # a handler's answer may be what cannot be sent
            self.fail(error)
        return taken

    def _dispatch(self, burst: bytearray) -> None:
        handlers, now_s = self.handlers, time.time()
        for start in range(0, len(burst), FRAME_BYTES):
            header, size = HEADER.unpack_from(burst, start)
            payload = burst[start + DATA_AT : start + DATA_AT + size]
            if header <= LARGEST_STANDARD:  # CANopen has no extended frames, and we use no remote ones
                if self.off:
                    continue
                self.frames += 1
                self.bits += FRAME_BITS[size]
                handler = handlers.get(header)
                if handler is not None:
                    handler(payload, now_s)
                else:
                    self.fallback(header, payload, now_s)
            elif header & ERROR:
                news = describe_error_frame(header & IDENTIFIER_MASK, payload)
                restarted = news.restarted and self.off
                self.off = news.down or (self.off and not restarted)
                self.on_error_frame(news._replace(restarted=restarted))


def open_port(spec: str, only: Sequence[int] = ()) -> CanPort:
    """Open "INTERFACE:CHANNEL", e.g. "socketcan:can0", "localcan:/run/bus.sock". Raises BusError.

    `only`: identifiers of interest, and no other frame is received; none = all.
    """
    interface, separator, channel = spec.partition(":")
    if not (interface and separator and channel):
        raise BusError(f'bus "{spec}": must be INTERFACE:CHANNEL, for example socketcan:vcan0')
    try:
        filters: can.typechecking.CanFilters = [
            {"can_id": can_id, "can_mask": 0x7FF, "extended": False} for can_id in only
        ]
        bus = can.Bus(
            interface=interface, channel=channel, receive_own_messages=False, can_filters=filters or None
        )
    except (can.CanError, OSError, ValueError, ImportError) as error:
        raise BusError(f"bus {spec}: cannot be opened: {_with_advice(error)}") from None
    return CanPort(bus, spec)


def describe_error_frame(error_class: int, payload: bytes | bytearray) -> BusNews:
    """Describe a SocketCAN error frame by its most severe part."""
    if error_class & BUS_OFF:
        return BusNews("bus-off", frames_lost=True, down=True)
    if error_class & CONTROLLER_CLASS and len(payload) > 1:
        for bits, text in CONTROLLER_PROBLEMS:
            if payload[1] & bits:
                lost, active = bool(payload[1] & OVERRUNS), bool(payload[1] & ERROR_ACTIVE)
                return BusNews(text, lost, down=False, restarted=active)
    for bit, text in ERROR_CLASSES:
        if error_class & bit:
            return BusNews(text, frames_lost=False, down=False, restarted=bit == RESTARTED)
    return BusNews(f"error frame of class 0x{error_class:X}", frames_lost=False, down=False)


def _with_advice(error: Exception) -> str:
    """Return the first line of python-can's message, and what to do where the errno says it."""
    reason = str(error).splitlines()[0] if str(error) else type(error).__name__
    advice = ADVICE.get(error_code(error))
    return f"{reason}; {advice}" if advice else reason


def _ignore(*_arguments: object) -> None:
    pass
