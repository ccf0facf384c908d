"""The controller's only access to the bus: a python-can bus that the event loop reads, without a thread.

A frame is passed to the handler of its CAN-ID, any other to `fallback` (SDO, NMT and so on, for the canopen
library). Error frames become `BusNews`.
"""

import asyncio
import errno
import time
from collections.abc import Callable, Collection, Sequence

from can_frames.frame import (
    ERROR,
    FRAME,
    FRAME_BITS,
    FRAME_BYTES,
    IDENTIFIER_MASK,
    LARGEST_STANDARD,
    pack_frame,
)
from can_frames.frame_bus import SendTimeouts, error_code, frame_bus
from kernels.lean_import import as_if_absent
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.io.error_frames import BusNews, describe_error_frame

with as_if_absent("asammdf"):  # python-can imports it and pandas for MF4 logs: 0.5 s at every start
    import can

Handler = Callable[[bytes, float], None]

FRAMES_PER_WAKE = 64
"""Bounds the frames read at once, so that a bus without idle time does not hold up timers; chosen."""
CATCH_UP_S = 0.005
CATCH_UP_STEPS = 100
"""Interval and number of the checks of `caught_up`; chosen."""
FRAMES_PER_STEP_MAX = 106
"""Bounds the frames of a bus of 1 Mbit/s in `CATCH_UP_S`; if more arrive, some had been queued."""
SEND_TIMEOUTS = SendTimeouts(queue_s=0.02, interface_s=None)
"""Bounds how long a transmit queue may stay full; chosen. SocketCAN queues ten frames by default."""
SIZE_AT = 4
"""Offset of the data length in a frame."""
ADVICE: dict[int, str] = {
    errno.EAFNOSUPPORT: "this kernel has no SocketCAN; use localcan:SOCKET, which `hil-sim run` serves",
    errno.ENODEV: "there is no such interface; `ip link` lists them",
    errno.ENETDOWN: "the interface is down; `ip link set ... up` (with its bitrate) switches it on",
    errno.ENOBUFS: "no node acknowledges; check that a node is on, the cable, termination and bit rate",
}
"""Remedies for errors of SocketCAN whose message names none."""


class BusError(ServoCtrlError):
    """The bus cannot be opened, or it failed during a run."""


class TxFrame:
    """A cyclic frame."""

    def __init__(self, burst: list[bytes], can_id: int) -> None:
        self._burst, self._can_id = burst, can_id

    def send(self, payload: bytes) -> None:
        """Send `payload` with the port's next `flush`."""
        self._burst.append(pack_frame(self._can_id, payload))


class CanPort:
    """An open bus. `handlers` maps CAN-IDs to callables of (data, timestamp in seconds)."""

    def __init__(self, bus: can.BusABC, name: str) -> None:
        self.name = name
        self.frames = self.bits = 0
        """Frames sent and received so far, and their bits by `FRAME_BITS`."""
        self.handlers: dict[int, Handler] = {}
        self.fallback: Callable[[int, bytearray, float], None] = _ignore
        self.on_error_frame: Callable[[BusNews], None] = _ignore
        self.on_down: Callable[[BusError], None] = _ignore
        self.on_burst: Callable[[], None] = _ignore
        """Called after frames were read."""
        self.off = False
        """Bus-off: frames are neither sent nor passed on until the interface reports its restart."""
        self._bus, self._frames = bus, frame_bus(bus, SEND_TIMEOUTS)
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
        """Wait until queued frames are read: the first inputs behind them would be late."""
        for _ in range(CATCH_UP_STEPS):
            before = self.frames
            await asyncio.sleep(CATCH_UP_S)
            if self.frames - before <= FRAMES_PER_STEP_MAX:
                return

    def finish(self) -> None:
        """Read what has arrived, `FRAMES_PER_WAKE` frames at most, and stop reading."""
        read, before = 0, -1
        while self._loop is not None and before < read < FRAMES_PER_WAKE:
            before = read
            read += self._drain()
        self.detach()

    def detach(self) -> None:
        """Stop reading."""
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
        """Send the cyclic frames in one batch. A failure is passed to `on_down`."""
        burst = b"".join(self._burst)
        self._burst.clear()
        try:
            self._send(burst)
        except (can.CanError, OSError) as error:
            self.fail(error)

    def send(self, can_id: int, payload: bytes) -> None:
        """Send one frame now; may be called from a worker thread. Raises BusError."""
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
        """Stop reading and call `on_down`: the bus has failed."""
        self.detach()
        if not isinstance(error, BusError):
            error = BusError(f"bus {self.name} failed: {_with_advice(error)}")
        self.on_down(error)

    def read_arrived(self) -> bool:
        """Read what has arrived without waiting for it; return whether frames were there."""
        return self._loop is not None and self._drain() > 0

    def peers(self) -> Collection[int]:
        """Process ids at the other end of the bus; empty where the interface does not name them."""
        return self._frames.peers

    def _drain(self) -> int:
        """Read about `FRAMES_PER_WAKE` of the frames that have arrived; return how many."""
        read = 0
        try:
            for burst in self._frames.waiting():
                self._dispatch(burst)
                read += len(burst) // FRAME_BYTES
                if read >= FRAMES_PER_WAKE:
                    break
        except (can.CanError, OSError, BusError) as error:  # raised by reading, or by a handler that sends
            self.fail(error)
        if read:
            self.on_burst()
        return read

    def _dispatch(self, burst: bytearray) -> None:
        handlers, now_s = self.handlers, time.time()
        for header, size, data in FRAME.iter_unpack(burst):
            if header <= LARGEST_STANDARD:  # CANopen has no extended frames, and we use no remote ones
                if self.off:
                    continue
                self.frames += 1
                self.bits += FRAME_BITS[size]
                handler = handlers.get(header)
                if handler is not None:
                    handler(data[:size], now_s)
                else:
                    self.fallback(header, bytearray(data[:size]), now_s)
            elif header & ERROR:
                news = describe_error_frame(header & IDENTIFIER_MASK, data[:size])
                restarted = news.restarted and self.off
                self.off = news.down or (self.off and not restarted)
                self.on_error_frame(news._replace(restarted=restarted))


def open_port(spec: str, only: Sequence[int] = ()) -> CanPort:
    """Open "INTERFACE:CHANNEL", e.g. "socketcan:can0", "localcan:/run/bus.sock". Raises BusError.

    `only`: CAN-IDs to receive; empty: all.
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


def _with_advice(error: Exception) -> str:
    """Return the first line of python-can's message, and the remedy for its errno if there is one."""
    reason = str(error).splitlines()[0] if str(error) else type(error).__name__
    advice = ADVICE.get(error_code(error))
    return f"{reason}; {advice}" if advice else reason


def _ignore(*_arguments: object) -> None:
    pass
