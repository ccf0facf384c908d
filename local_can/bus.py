"""python-can interface `localcan`: `can.Bus(interface="localcan", channel="/path/to/hub.sock")`."""

import logging
import select
import time

import can
from can.typechecking import CanFilters

from local_can import wire
from local_can.attaching import ATTACH_TIMEOUT_S, AttachError, attached, served_here
from local_can.listening import peer_pids
from local_can.served_hub import ServedHub

_LOG = logging.getLogger(__name__)
_SEND_TIMEOUT_S = 5.0
"""How long a send without a timeout waits for a busy hub (chosen)."""
_FLAGS = wire.EXTENDED | wire.REMOTE | wire.ERROR
_new_message = can.Message.__new__


class LocalCanBus(can.BusABC):
    """A client of the hub at the socket `channel`.

    Lost frames are always reported: `recv` returns the hub's error frame in their place, despite filters,
    `lost_frames` counts them, and a warning is logged. One thread may receive, any may send.

    The hub filters like an adapter. Filters given here apply from the first frame on. After filters are set
    later, frames already in transit still arrive, as with SocketCAN.
    """

    def __init__(
        self,
        channel: str,
        receive_own_messages: bool = False,
        can_filters: CanFilters | None = None,
        fd: bool = False,
        serve: bool = False,
        attach_timeout_s: float = ATTACH_TIMEOUT_S,
        **kwargs: object,
    ) -> None:
        """Attach to the hub, waiting at most `attach_timeout_s` for its answer.

        With `serve` the hub runs in this process unless another process serves it already. It then passes
        frames on while this bus is read: the file to wait on is readable when any client needs service, and
        `more` is true while frames wait although it is not readable.

        Raises:
            can.CanInitializationError: No hub is at `channel`, it does not answer, none can be there, or `fd`
            is set.
        """
        if fd:
            raise can.CanInitializationError("localcan carries classic CAN frames only, not CAN FD")
        self.channel = str(channel)
        self.channel_info = f"localcan hub at {self.channel}"
        self.lost_frames = 0
        own = wire.ATTACH_WITH_OWN if receive_own_messages else wire.ATTACH
        packets = (wire.pack_filters(hub_filters(can_filters or None)), own)
        try:
            self._served = served_here(self.channel, packets) if serve else None
            self._socket = self._served or attached(self.channel, packets, attach_timeout_s)
        except AttachError as error:
            raise can.CanInitializationError(str(error)) from error
        self._socket_send = self._socket.send
        self._receive_into = self._socket.recv_into
        self._buffer = bytearray(wire.MOST_BYTES)
        super().__init__(channel, can_filters=can_filters, **kwargs)  # sends the filters to the hub again

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Return the next message that passes the filters, or None after `timeout` s; None: no limit.

        It replaces python-can's `recv`, whose deadlines use the wall clock, and whose filtering, logging and
        inner call cost more than the reception itself.

        Raises:
            can.CanOperationError: The hub has ended.
        """
        deadline_s = None if not timeout else time.monotonic() + timeout
        while True:
            if not self._receive():
                if timeout == 0 or not self._wait(select.POLLIN, deadline_s):
                    return None
                continue
            message = self._unpack()
            if not self._filters_itself or message.is_error_frame or self._matches_filters(message):
                return message

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send `msg` to the hub, waiting at most `timeout` seconds (None: 5 s) while the bus is too busy.

        Raises:
            can.CanOperationError: The bus stayed too busy, the hub ended, or it is not a classic CAN frame.
        """
        self._hand_over(pack(msg), timeout)

    def start_bursts(self) -> None:
        """Make the hub send several frames a packet; from now on only `receive_burst` may receive."""
        self._hand_over(wire.BURSTS, None)

    def receive_burst(self) -> bytearray:
        """Return the frames of one packet of the hub in wire format; empty if none waits.

        Filters beyond the number that the hub accepts are not applied; the reader handles error frames.

        Raises:
            can.CanOperationError: The hub has ended.
        """
        if self._served is not None:
            return self._served.receive(wire.MOST_FRAMES)
        return self._buffer[: self._receive()]

    def send_burst(self, frames: bytes, timeout: float | None = None) -> None:
        """Send frames in wire format to the hub; `timeout` and errors are those of `send`."""
        while frames:
            self._hand_over(frames[: wire.MOST_BYTES], timeout)
            frames = frames[wire.MOST_BYTES :]

    @property
    def serves(self) -> bool:
        """Whether the hub runs in this process."""
        return self._served is not None

    @property
    def more(self) -> bool:
        """Whether frames wait although the file is not readable; read until there are none."""
        return self._served is not None and self._served.more

    @property
    def peers(self) -> list[int]:
        """Process ids of the hub, or of the clients that it serves, as far as they are in our namespace."""
        return self._socket.peers if isinstance(self._socket, ServedHub) else peer_pids([self._socket])

    def fileno(self) -> int:
        """File descriptor to wait on; -1 after `shutdown`."""
        return self._socket.fileno()

    def shutdown(self) -> None:
        """Leave the bus."""
        super().shutdown()
        self._socket.close()

    def _apply_filters(self, filters: CanFilters | None) -> None:
        """Send the filters to the hub; if there are more than it accepts, filter here frame by frame."""
        self._filters_itself = filters is not None and len(filters) > wire.MOST_FILTERS
        self._hand_over(wire.pack_filters(hub_filters(filters)), None)

    def _hand_over(self, packet: bytes, timeout: float | None) -> None:
        """Send `packet` to the hub as soon as it has space."""
        deadline_s = None
        while True:
            try:
                self._socket_send(packet)
            except BlockingIOError:
                limit_s = _SEND_TIMEOUT_S if timeout is None else timeout
                if deadline_s is None:
                    deadline_s = time.monotonic() + limit_s
                if not self._wait(select.POLLOUT, deadline_s):
                    raise can.CanOperationError(
                        f"{self.channel_info} took no frame from this client for {limit_s:g} s"
                    ) from None
            except OSError as error:
                raise can.CanOperationError(f"{self.channel_info} has ended: {error.strerror}") from error
            else:
                return

    def _receive(self) -> int:
        """Read a packet into the buffer; return its size, 0 if none waits."""
        try:
            size = self._receive_into(self._buffer)
        except BlockingIOError:
            return 0
        except OSError as error:
            raise can.CanOperationError(f"{self.channel_info} has ended: {error.strerror}") from error
        if not size:
            raise can.CanOperationError(f"{self.channel_info} has ended")
        return size

    def _wait(self, event: int, deadline_s: float | None) -> bool:
        """Wait until the socket is ready for `event` or the deadline; return whether it is ready."""
        waiter = select.poll()
        waiter.register(self._socket, event)
        if deadline_s is None:
            return bool(waiter.poll())
        return bool(waiter.poll(max(0.0, deadline_s - time.monotonic()) * 1000.0))

    def _unpack(self) -> can.Message:
        """Return the message in the buffer, without calling `Message()`, which takes three times as long."""
        header, length, mark = wire.HEADER.unpack_from(self._buffer)
        message = _new_message(can.Message)
        message.timestamp = time.time()
        message.channel = self.channel
        message.is_fd = message.bitrate_switch = message.error_state_indicator = False
        message.is_rx = mark != wire.MARK_OWN
        message.dlc = length
        if header & _FLAGS:
            extended = message.is_extended_id = bool(header & wire.EXTENDED)
            message.arbitration_id = header & (wire.EXTENDED_ID_MASK if extended else wire.STANDARD_ID_MASK)
            message.is_remote_frame = bool(header & wire.REMOTE)
            message.is_error_frame = bool(header & wire.ERROR)
            message.data = bytearray() if message.is_remote_frame else self._buffer[8 : 8 + length]
            if message.is_error_frame:
                self._note_loss(wire.lost_frames(header, message.data))
        else:
            message.arbitration_id = header
            message.is_extended_id = message.is_remote_frame = message.is_error_frame = False
            message.data = self._buffer[8 : 8 + length]
        return message

    def _note_loss(self, lost_frames: int) -> None:
        if lost_frames:
            self.lost_frames += lost_frames
            _LOG.warning(
                "%d frames lost: this client of the %s reads too late", lost_frames, self.channel_info
            )


def pack(message: can.Message) -> bytes:
    """Convert `message` to a SocketCAN frame.

    Raises:
        can.CanOperationError: It is a CAN FD frame, has more than eight bytes or a too large identifier.
    """
    header = message.arbitration_id
    if header > (wire.EXTENDED_ID_MASK if message.is_extended_id else wire.STANDARD_ID_MASK):
        raise can.CanOperationError(f"the identifier is too great for a CAN frame: {message}")
    if message.is_extended_id:
        header |= wire.EXTENDED
    if message.is_remote_frame:
        header |= wire.REMOTE
    if message.is_error_frame:
        header |= wire.ERROR
    if message.is_fd or message.dlc > 8:
        raise can.CanOperationError(f"localcan carries classic CAN frames only, not {message}")
    return wire.FRAME.pack(header, message.dlc, 0, message.data)


def hub_filters(filters: CanFilters | None) -> wire.Filters:
    """Convert python-can's filters to the hub's; pass all if there are more than the hub accepts."""
    if filters is None or len(filters) > wire.MOST_FILTERS:
        return wire.PASS_ALL
    hub = []
    for each in filters:
        can_id, mask = each["can_id"], each["can_mask"]
        if can_id & mask & ~wire.EXTENDED_ID_MASK:
            continue  # no identifier has the required bit
        can_id, mask = can_id & wire.EXTENDED_ID_MASK, mask & wire.EXTENDED_ID_MASK
        if "extended" in each:
            can_id, mask = can_id | wire.EXTENDED * bool(each["extended"]), mask | wire.EXTENDED
        hub.append((can_id, mask))
    return tuple(hub)
