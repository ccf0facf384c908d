"""The hub: takes one frame at a time, the one that wins arbitration, and passes it to everyone else."""

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
_BACKLOG = 64  # connections that may wait to be accepted (chosen)
IDLE_S = 0.5
"""Bounds a wait: a signal that comes just before it begins is acted on after it (chosen)."""
_PACKET_AND_MORE = FILTERS_BYTES + 1  # one byte more than the longest has, to notice one that is too long
_MOST_ROUTES = 1024
"""Bounds the memory of the routes (chosen)."""


class HubError(Exception):
    """The hub cannot be at that path."""


class HubPresentError(HubError):
    """Another hub serves it already."""


class Hub:
    """A CAN bus at a Unix socket.

    Of the frames at the heads of its clients' sockets the one with the lowest identifier goes first, then
    the heads are looked at again. Frames of one packet go one by one too, and what goes to a client meanwhile
    goes in one packet where the client takes that. At `bitrate` 0 the bus is as fast as its slowest reader; a
    reader that makes the others wait longer than `patience_s` loses frames. At a set bitrate (bit/s) every
    frame takes its exact length in bit times, and nobody waits for a reader whose `queue_frames` are full.

    As an adapter does, it hands each client only what passes that client's filters.
    """

    def __init__(self, path: Path, bitrate: int, queue_frames: int, patience_s: float) -> None:
        self._path = path
        self._bitrate = bitrate
        self._queue_frames = queue_frames
        self._patience_s = 0.0 if bitrate else patience_s
        self._free_at_s = 0.0  # when the frame that is on the paced bus ends
        self._ports: dict[int, Port] = {}
        self._parties: list[Party] = []  # in order of their connection
        self._heads: dict[Party, deque[bytes]] = {}  # what each client wants to send, in order of arrival
        self._due: list[Party] = []  # to be flushed: who got frames in this turn
        self._contended = False  # whether the frames read next were waiting during the frame before
        self._routes: dict[tuple[Party, bytes], tuple[Party, ...]] = {}  # to whom by sender and header
        self._listener = _listen(path)
        self._inode = path.stat().st_ino
        self._epoll = select.epoll()
        self._epoll.register(self._listener, select.EPOLLIN)

    def run(self) -> None:
        """Serve until an exception, such as a signal handler's, ends it."""
        while True:
            self.turn(IDLE_S)

    def fileno(self) -> int:
        """A file that is readable while a client wants something."""
        return self._epoll.fileno()

    @property
    def busy(self) -> bool:
        """Whether frames that have come wait for the next turn."""
        return bool(self._heads)

    def waiting(self, party: Party) -> int:
        """How many frames of a party wait for the next turns."""
        return len(self._heads.get(party, ()))

    def join(self, party: Party) -> None:
        """Let somebody send packets, the first of which attach it to the bus."""
        self._parties.append(party)

    def take(self, party: Party, packet: bytes) -> bool:
        """Take what a party sends; return whether it was something."""
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
        """Read what clients send, waiting at most `wait_s` for it, and pass on until one may have more."""
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
        # On a paced bus a frame that is there at the end of the one before has waited for it, even one of
        # the same client: the hub reads one packet of a client at a time.
        self._contended = bool(heads) or (sending and paced)

    def close(self) -> None:
        """Leave: close every connection and remove the socket, unless another hub has replaced it."""
        for party in self._parties:
            party.close()
        self._epoll.close()
        self._listener.close()
        with contextlib.suppress(FileNotFoundError):
            if self._path.stat().st_ino == self._inode:
                self._path.unlink()

    def _transmit(self) -> bool:
        """Pass on the frame that wins; return whether it was the last of its sender that is here."""
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
        """Hand frames of one sender, which nobody competes with, to whom they are for."""
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
        """All others, in order of their connection, whose filters `frame` passes.

        It is kept until a filter or who is there changes: how many filters there are costs a frame nothing.
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

        A frame that was waiting already starts where the last one ended, so lateness of this process does
        not add up.
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
            return  # it went away before it was let in
        sock.setblocking(False)
        port = Port(sock, self._epoll, self._queue_frames, self._patience_s)
        self._ports[sock.fileno()] = port
        self.join(port)
        self._epoll.register(sock, select.EPOLLIN)

    def _read(self, port: Port) -> None:
        try:
            packet = port.sock.recv(_PACKET_AND_MORE)
        except (BlockingIOError, ConnectionResetError):
            return  # a client that left without reading everything; what it sent before comes next
        if not self.take(port, packet):
            if packet:
                begin = packet[: FRAME_BYTES + 1]
                _LOG.warning("client %d is cut off: it sent no CAN frame but %r", port.sock.fileno(), begin)
            del self._ports[port.sock.fileno()]
            self._parties.remove(port)
            port.close()
            self._routes.clear()


def _listen(path: Path) -> socket.socket:
    """Socket at `path`, mode 0600; it appears there only once it listens, so nobody finds it half ready."""
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
    """Accept nothing at `path` but the socket of a hub that was killed.

    Raises:
        HubError: A hub answers there, or something is there that is no socket.
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
