"""The hub: passes one frame at a time, the one that wins arbitration, to all other clients."""

import contextlib
import errno
import logging
import os
import select
import socket
import stat
import time
from collections import deque
from collections.abc import Collection
from pathlib import Path

from local_can.port import Party, Port
from local_can.wire import (
    ATTACH,
    ATTACH_WITH_OWN,
    ATTACHED,
    BURSTS,
    FILTERS_BYTES,
    FRAME_BYTES,
    HEADER,
    MARK_OWN,
    arbitration_rank,
    frame_bits,
    frames_of,
    passes,
    unpack_filters,
)

_LOG = logging.getLogger(__name__)
_BACKLOG = 64  # bounds the connections that wait to be accepted (chosen)
IDLE_S = 0.5
"""Bounds a wait, because a signal just before it is handled only after it (chosen)."""
_PACKET_AND_MORE = FILTERS_BYTES + 1  # one byte more than the longest packet, to detect longer ones
_MOST_ROUTES = 1024
"""Bounds the number of kept routes (chosen)."""


class HubError(Exception):
    """No hub is possible at that path."""


class HubPresentError(HubError):
    """Another hub serves the path already."""


class Hub:
    """A CAN bus at a Unix socket.

    The hub passes the frame with the lowest identifier among the heads of its clients' sockets, then compares
    the heads again. Frames of one packet also compete one by one; frames to one client share a packet if the
    client accepts bursts. At `bitrate` 0 the bus is as fast as its slowest reader, but a reader that delays
    the others by more than `patience_s` loses frames. At another bitrate (bit/s) every frame takes its exact
    length in bit times, and the bus does not wait for a reader whose `queue_frames` are full.

    Like an adapter, it passes to each client only frames that match that client's filters.
    """

    def __init__(self, path: Path, bitrate: int, queue_frames: int, patience_s: float) -> None:
        self._path = path
        self._bitrate = bitrate
        self._queue_frames = queue_frames
        self._patience_s = 0.0 if bitrate else patience_s
        self._free_at_s = 0.0  # end of the present frame on the paced bus
        self._ports: dict[int, Port] = {}
        self._parties: list[Party] = []  # in order of their connection
        self._heads: dict[Party, deque[bytes]] = {}  # frames that each client sends, in order of arrival
        self._due: list[Party] = []  # clients that got frames in this turn and need a flush
        self._contended = False  # whether the frames read next waited during the previous frame
        self._routes: dict[tuple[Party, bytes], tuple[Party, ...]] = {}  # receivers by sender and header
        self._listener = _listen(path)
        self._inode = path.stat().st_ino
        self._epoll = select.epoll()
        self._epoll.register(self._listener, select.EPOLLIN)

    def run(self) -> None:
        """Serve until an exception, such as a signal handler's, ends it."""
        while True:
            self.turn(IDLE_S)

    def fileno(self) -> int:
        """Return a file descriptor that is readable while a client needs service."""
        return self._epoll.fileno()

    @property
    def busy(self) -> bool:
        """Whether received frames wait for the next turn."""
        return bool(self._heads)

    def waiting(self, party: Party) -> int:
        """Return the number of frames of a client that wait for the next turns."""
        return len(self._heads.get(party, ()))

    def join(self, party: Party) -> None:
        """Add a client, whose first packets attach it to the bus."""
        self._parties.append(party)

    def take(self, party: Party, packet: bytes) -> bool:
        """Process a packet of a client; return whether it was valid."""
        if party.attached and (frames := frames_of(packet)) is not None:
            self._heads.setdefault(party, deque()).extend(frames)
        elif packet in {ATTACH, ATTACH_WITH_OWN} and not party.attached:
            party.attached = True
            party.wants_own = packet == ATTACH_WITH_OWN
            party.answer(ATTACHED)
            self._routes.clear()
        elif packet == BURSTS:
            party.bursts = True
        elif (filters := unpack_filters(packet)) is not None:
            party.filters = filters
            self._routes.clear()
        else:
            return False
        return True

    def turn(self, wait_s: float) -> None:
        """Read packets, waiting at most `wait_s`, and pass frames on until a client may have more."""
        heads, ports, paced = self._heads, self._ports, bool(self._bitrate)
        for fileno, event in self._epoll.poll(0 if self._contended else wait_s):
            port = ports.get(fileno)
            if port is None:
                self._accept()
            else:
                if event & select.EPOLLOUT:
                    port.flush()
                if event != select.EPOLLOUT and port not in heads:
                    self._read(port)
        sending = bool(heads)
        if len(heads) == 1 and not paced:
            self._pass_on(*heads.popitem())
        else:
            while heads and not self._transmit() and not paced:
                pass
        for party in self._due:
            party.flush()
        self._due.clear()
        # On a paced bus a frame present at the end of the previous one has waited for it, even a frame of
        # the same client, because the hub reads one packet of a client at a time.
        self._contended = bool(heads) or (sending and paced)

    def close(self) -> None:
        """Close every connection and remove the socket, unless another hub has replaced it."""
        for party in self._parties:
            party.close()
        self._epoll.close()
        self._listener.close()
        with contextlib.suppress(FileNotFoundError):
            if self._path.stat().st_ino == self._inode:
                self._path.unlink()

    def _transmit(self) -> bool:
        """Pass on the frame that wins arbitration; return whether its sender has no further frame here."""
        heads = self._heads
        sender = min(heads, key=self._rank) if len(heads) > 1 else next(iter(heads))
        frames = heads[sender]
        frame = frames.popleft()
        if not frames:
            del heads[sender]
        if self._bitrate:
            self._occupy(frame)
        self._pass_on(sender, (frame,))
        return not frames

    def _pass_on(self, sender: Party, frames: Collection[bytes]) -> None:
        """Pass frames of one sender, already arbitrated, to their receivers."""
        routes, due = self._routes, self._due
        for frame in frames:
            route = routes.get((sender, frame[:4]))
            if route is None:
                route = self._find_route(sender, frame)
            for receiver in route:
                receiver.deliver(frame)
                if receiver not in due:
                    due.append(receiver)
        if sender.wants_own:
            for frame in frames:
                if passes(HEADER.unpack_from(frame)[0], sender.filters):
                    sender.deliver(frame[:5] + bytes((MARK_OWN,)) + frame[6:])
            due.append(sender)

    def _find_route(self, sender: Party, frame: bytes) -> tuple[Party, ...]:
        """Return the other clients whose filters `frame` passes, in order of their connection.

        The route is kept until a filter or a client changes, so that many filters cost no time per frame.
        """
        header = HEADER.unpack_from(frame)[0]
        others = (party for party in self._parties if party.attached and party is not sender)
        route = tuple(party for party in others if passes(header, party.filters))
        if len(self._routes) >= _MOST_ROUTES:
            self._routes.clear()
        self._routes[sender, frame[:4]] = route
        return route

    def _rank(self, port: Party) -> int:
        return arbitration_rank(self._heads[port][0])

    def _occupy(self, frame: bytes) -> None:
        """Wait until `frame` has been on the bus for its bit times.

        A frame that was waiting starts at the end of the previous one, so that delays of this process do not
        accumulate.
        """
        now_s = time.monotonic()
        start_s = self._free_at_s if self._contended else max(self._free_at_s, now_s)
        self._free_at_s = start_s + frame_bits(frame) / self._bitrate
        if self._free_at_s > now_s:
            time.sleep(self._free_at_s - now_s)

    def _accept(self) -> None:
        try:
            sock, _ = self._listener.accept()
        except (BlockingIOError, ConnectionError):
            return  # the client disconnected before it was accepted
        sock.setblocking(False)
        port = Port(sock, self._epoll, self._queue_frames, self._patience_s)
        self._ports[sock.fileno()] = port
        self.join(port)
        self._epoll.register(sock, select.EPOLLIN)

    def _read(self, port: Port) -> None:
        try:
            packet = port.sock.recv(_PACKET_AND_MORE)
        except (BlockingIOError, ConnectionResetError):
            return  # the client left with unread data; its earlier packets follow
        if not self.take(port, packet):
            if packet:
                begin = packet[: FRAME_BYTES + 1]
                _LOG.warning("client %d is cut off: it sent no CAN frame but %r", port.sock.fileno(), begin)
            del self._ports[port.sock.fileno()]
            self._parties.remove(port)
            port.close()
            self._routes.clear()


def _listen(path: Path) -> socket.socket:
    """Make a socket at `path`, mode 0600, which appears there only once it listens."""
    nascent = path.with_name(f"{path.name}.{os.getpid()}")
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        _refuse_to_replace(path)
        mask = os.umask(0o177)
        try:
            listener.bind(str(nascent))
        finally:
            os.umask(mask)
        listener.listen(_BACKLOG)
        listener.setblocking(False)
        nascent.rename(path)
    except OSError as error:
        listener.close()
        nascent.unlink(missing_ok=True)
        raise HubError(f"no hub can be at {path}: {error.strerror or error}") from error
    except HubError:
        listener.close()
        raise
    return listener


def _refuse_to_replace(path: Path) -> None:
    """Accept at `path` nothing or the socket of a killed hub.

    Raises:
        HubError: A hub answers there, or the file there is no socket.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return
    if not stat.S_ISSOCK(mode):
        raise HubError(f"no hub can be at {path}: that is no socket")
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as probe:
        probe.settimeout(1.0)
        if probe.connect_ex(str(path)) != errno.ECONNREFUSED:
            raise HubPresentError(f"a hub is at {path} already")
