"""The hub: passes one frame at a time, the one that wins arbitration, to all other clients."""

import contextlib
import logging
import select
import time
from collections import deque
from collections.abc import Collection
from pathlib import Path

from local_can.listening import listen_at, peer_pids
from local_can.port import Client, Port
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
    headers_of,
    is_frames,
    passes,
    split,
    unpack_filters,
)

_LOG = logging.getLogger(__name__)
IDLE_S = 0.5
"""Bounds a wait, because a signal just before it is handled only after it (chosen)."""
_PACKET_AND_MORE = FILTERS_BYTES + 1  # one byte more than the longest packet, to detect longer ones
_MOST_ROUTES = 1024
"""Bounds the number of kept routes (chosen)."""

Route = tuple[tuple[Client, tuple[int, ...]], ...]
"""Receivers of a packet, each with the places of its frames; without places it gets the whole packet."""


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
        self._clients: list[Client] = []  # in order of their connection
        self._heads: dict[Client, deque[bytes]] = {}  # packets that each client sends, in order of arrival
        self._due: list[Client] = []  # clients that got frames in this turn and need a flush
        self._contended = False  # whether the frames read next waited during the previous frame
        self._routes: dict[tuple[Client, tuple[int, ...]], Route] = {}  # by sender and headers of the packet
        self._listener = listen_at(path)
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

    def waiting(self, client: Client) -> int:
        """Return the number of frames of a client that wait for the next turns."""
        packets = self._heads.get(client)
        return sum(map(len, packets)) // FRAME_BYTES if packets else 0

    @property
    def peers(self) -> list[int]:
        """Process ids of the clients that are on the bus."""
        return peer_pids(port.sock for port in self._ports.values() if port.attached)

    def join(self, client: Client) -> None:
        """Add a client, whose first packets attach it to the bus."""
        self._clients.append(client)

    def take(self, client: Client, packet: bytes) -> bool:
        """Process a packet of a client; return whether it was valid."""
        if client.attached and is_frames(packet):
            self._heads.setdefault(client, deque()).append(packet)
        elif packet in {ATTACH, ATTACH_WITH_OWN} and not client.attached:
            client.attached = True
            client.wants_own = packet == ATTACH_WITH_OWN
            client.answer(ATTACHED)
            self._routes.clear()
        elif packet == BURSTS:
            client.bursts = True
        elif (filters := unpack_filters(packet)) is not None:
            client.filters = filters
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
        for client in self._due:
            client.flush()
        self._due.clear()
        # On a paced bus a frame present at the end of the previous one has waited for it, even a frame of
        # the same client, because the hub reads one packet of a client at a time.
        self._contended = bool(heads) or (sending and paced)

    def close(self) -> None:
        """Close every connection and remove the socket, unless another hub has replaced it."""
        for client in self._clients:
            client.close()
        self._epoll.close()
        self._listener.close()
        with contextlib.suppress(FileNotFoundError):
            if self._path.stat().st_ino == self._inode:
                self._path.unlink()

    def _transmit(self) -> bool:
        """Pass on the frame that wins arbitration; return whether its sender has no further frame here."""
        heads = self._heads
        sender = min(heads, key=self._rank) if len(heads) > 1 else next(iter(heads))
        packets = heads[sender]
        frame, *others = split(packets.popleft())
        packets.extendleft(reversed(others))
        if not packets:
            del heads[sender]
        if self._bitrate:
            self._occupy(frame)
        self._pass_on(sender, (frame,))
        return not packets

    def _pass_on(self, sender: Client, packets: Collection[bytes]) -> None:
        """Pass packets of one sender, already arbitrated, to their receivers."""
        routes, due = self._routes, self._due
        for packet in packets:
            headers = headers_of(packet)
            route = routes.get((sender, headers))
            if route is None:
                route = self._find_route(sender, headers)
            for receiver, places in route:
                receiver.deliver(b"".join([_frame(packet, at) for at in places]) if places else packet)
                if receiver not in due:
                    due.append(receiver)
        if sender.wants_own:
            for frame in (frame for packet in packets for frame in split(packet)):
                if passes(HEADER.unpack_from(frame)[0], sender.filters):
                    sender.deliver(frame[:5] + bytes((MARK_OWN,)) + frame[6:])
            due.append(sender)

    def _find_route(self, sender: Client, headers: tuple[int, ...]) -> Route:
        """Return the other clients and which of the frames pass their filters, in order of their connection.

        The route is kept until a filter or a client changes, so that many filters cost no time per packet.
        """
        route = []
        for client in self._clients:
            if client.attached and client is not sender:
                places = tuple(at for at, header in enumerate(headers) if passes(header, client.filters))
                if places:
                    route.append((client, () if len(places) == len(headers) else places))
        if len(self._routes) >= _MOST_ROUTES:
            self._routes.clear()
        self._routes[sender, headers] = tuple(route)
        return self._routes[sender, headers]

    def _rank(self, port: Client) -> int:
        return arbitration_rank(self._heads[port][0])  # of the first frame of a packet

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
            self._clients.remove(port)
            port.close()
            self._routes.clear()


def _frame(packet: bytes, place: int) -> bytes:
    return packet[place * FRAME_BYTES : (place + 1) * FRAME_BYTES]
