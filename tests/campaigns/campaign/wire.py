"""The bus of a campaign run: controller, simulated nodes and a foreign station in one process.

It keeps the order and the frames of `localcan`, without sockets: the nodes have received a frame of the
controller when `send` returns, and their frames wait until the controller reads them. So a run is
reproducible, and a fault can be injected between any two frames. `frames` has all frames on the bus.
"""

from __future__ import annotations

import os
import threading
from collections import deque
from typing import TYPE_CHECKING, NamedTuple

import can

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.campaigns.campaign.virtual_time import VirtualLoop

NMT, SYNC = 0x000, 0x080
CONTROLLER, NODES, FOREIGN = "controller", "nodes", "foreign"

Arriving = list[tuple[int, bytes]]
"""Frames that arrive instead of a sent one."""


class Frame(NamedTuple):
    """A frame as it was sent, whether it arrived or not."""

    time_s: float
    cycle: int
    """SYNCs of the controller before it, counted from 0 with the first; -1 before that."""
    sender: str
    can_id: int
    data: bytes
    arrived: bool


class Wire:
    """`nodes` receives the frames for the nodes. `inbound` and `outbound` are faults of the transmission."""

    def __init__(self, loop: VirtualLoop) -> None:
        self.frames: list[Frame] = []
        self.cycle = -1
        self.nodes: Callable[[int, bytes], None] = _no_node
        self.on_sync: Callable[[], None] = _no_action
        self.inbound: Callable[[int, bytes], Arriving] | None = None
        """From the nodes to the controller."""
        self.outbound: Callable[[int, bytes], Arriving] | None = None
        """From the controller to the nodes."""
        self.failure: Exception | None = None
        """Exception that the interface of the controller raises; None = it works."""
        self.controller_dead = self.nodes_dead = False
        self.controller_port = ControllerPort(self)
        self.countdown = 0
        """Frames until `on_zero` is called; 0 = no call is due."""
        self.on_zero: Callable[[], None] = _no_action
        self._busy = False
        self._deferred: deque[Callable[[], None]] = deque()
        self._loop, self._thread = loop, threading.get_ident()

    def begin_next_run(self, loop: VirtualLoop) -> None:
        """Remove all faults, and connect another controller."""
        self.inbound = self.outbound = self.failure = None
        self.controller_dead = False
        self.countdown = 0
        self.controller_port.shutdown()
        self.controller_port = ControllerPort(self)
        self._loop, self._thread = loop, threading.get_ident()

    def from_controller(self, can_id: int, data: bytes) -> None:
        """Send a frame of the controller; frames of worker threads pass through the thread of the loop."""
        if threading.get_ident() != self._thread:
            self._loop.call_soon_threadsafe(self.from_controller, can_id, data)
            return
        if self.controller_dead:
            return
        if can_id == SYNC:
            self.cycle += 1
            self.on_sync()
        self._deliver_to_nodes(self._pass(CONTROLLER, self.outbound, can_id, data))

    def from_nodes(self, can_id: int, data: bytes) -> None:
        """Send a frame of a node."""
        for each_id, each_data in self._pass(NODES, self.inbound, can_id, data):
            self.controller_port.put(each_id, each_data)

    def send_foreign(self, can_id: int, data: bytes) -> None:
        """Send a frame of the foreign station to controller and nodes."""
        if self._busy:
            self.after_frame(lambda: self.send_foreign(can_id, data))
            return
        self.frames.append(Frame(self._loop.time(), self.cycle, FOREIGN, can_id, data, arrived=True))
        self.controller_port.put(can_id, data)
        self._deliver_to_nodes([(can_id, data)])

    def after_frame(self, action: Callable[[], None]) -> None:
        """Apply an action to the nodes, after the present frame if one is on the bus."""
        if self._busy:
            self._deferred.append(action)
        else:
            action()

    def error(self, error_class: int, data: bytes) -> None:
        """Let the interface of the controller report an error frame."""
        self.controller_port.put(error_class, data, is_error=True)

    def _deliver_to_nodes(self, arriving: Arriving) -> None:
        """Deliver frames to the nodes, which may send in turn; then apply the deferred actions."""
        if self.nodes_dead:
            return
        outer_busy, self._busy = self._busy, True
        for can_id, data in arriving:
            self.nodes(can_id, data)
        self._busy = outer_busy
        while self._deferred and not self._busy:
            self._deferred.popleft()()

    def _pass(
        self, sender: str, fault: Callable[[int, bytes], Arriving] | None, can_id: int, data: bytes
    ) -> Arriving:
        if self.countdown:
            self.countdown -= 1
            if not self.countdown:
                self.on_zero()
                fault = self.outbound if sender is CONTROLLER else self.inbound
        arriving = [(can_id, data)] if fault is None else fault(can_id, data)
        arrived = (can_id, data) in arriving
        self.frames.append(Frame(self._loop.time(), self.cycle, sender, can_id, data, arrived))
        return arriving


class ControllerPort:
    """The part of a python-can bus that `servo_ctrl.io.can_port.CanPort` uses."""

    channel_info = "the campaign's bus"

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._received: deque[can.Message] = deque()
        self._file = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._signalled = False

    def put(self, can_id: int, data: bytes, *, is_error: bool = False) -> None:
        """Queue a frame for the controller."""
        if self._file < 0 or self._wire.controller_dead:
            return
        self._received.append(
            can.Message(
                arbitration_id=can_id,
                data=data,
                is_extended_id=False,
                is_error_frame=is_error,
                timestamp=self._wire._loop.time(),
            )
        )
        self.wake()

    def wake(self) -> None:
        """Make the file readable."""
        if not self._signalled:
            self._signalled = True
            os.eventfd_write(self._file, 1)

    def fileno(self) -> int:
        """Return a file descriptor that is readable while frames are queued."""
        return self._file

    def recv(self, _timeout: float | None = None) -> can.Message | None:
        """Return the next frame, or None."""
        if self._wire.failure is not None:
            raise self._wire.failure
        if self._received:
            return self._received.popleft()
        if self._signalled:
            os.eventfd_read(self._file)
            self._signalled = False
        return None

    def send(self, message: can.Message, _timeout: float | None = None) -> None:
        """Send a frame to the bus."""
        if self._wire.failure is not None:
            raise self._wire.failure
        self._wire.from_controller(message.arbitration_id, bytes(message.data))

    def shutdown(self) -> None:
        """Leave the bus."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


def _no_node(_can_id: int, _data: bytes) -> None:
    """Drop a frame, because no node is connected yet."""


def _no_action() -> None:
    """Do nothing."""
