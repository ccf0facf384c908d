"""The bus of a campaign's run: controller, simulated nodes and a third station in one process.

It has the order and the frames of `localcan`, without sockets: what the controller sends is at the nodes
when `send` returns, and their answers wait where the controller reads. So a run is the same every time, and
a fault may stand between any two frames. Everything that was on the bus is in `frames`.
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

Passing = list[tuple[int, bytes]]
"""Frames that arrive in the place of one."""


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
    """`nodes` takes what the nodes hear. `inbound` and `outbound` are the faults on the way, if any."""

    def __init__(self, loop: VirtualLoop) -> None:
        self.frames: list[Frame] = []
        self.cycle = -1
        self.nodes: Callable[[int, bytes], None] = _nobody
        self.on_sync: Callable[[], None] = _nothing
        self.inbound: Callable[[int, bytes], Passing] | None = None
        """From the nodes to the controller."""
        self.outbound: Callable[[int, bytes], Passing] | None = None
        """From the controller to the nodes."""
        self.failure: Exception | None = None
        """What the controller's interface raises."""
        self.controller_dead = self.nodes_dead = False
        self.end = ControllerEnd(self)
        self.countdown = 0
        """Frames until `on_zero` is called; 0: it is not."""
        self.on_zero: Callable[[], None] = _nothing
        self._busy = False
        self._next: deque[Callable[[], None]] = deque()
        self._loop, self._thread = loop, threading.get_ident()

    def begin_again(self, loop: VirtualLoop) -> None:
        """Nothing is wrong any more, and another controller comes."""
        self.inbound = self.outbound = self.failure = None
        self.controller_dead = False
        self.countdown = 0
        self.end.shutdown()
        self.end = ControllerEnd(self)
        self._loop, self._thread = loop, threading.get_ident()

    def from_controller(self, can_id: int, data: bytes) -> None:
        """The controller sends; a worker thread's frames go through the loop's thread."""
        if threading.get_ident() != self._thread:
            self._loop.call_soon_threadsafe(self.from_controller, can_id, data)
            return
        if self.controller_dead:
            return
        if can_id == SYNC:
            self.cycle += 1
            self.on_sync()
        self._hand_over(self._pass(CONTROLLER, self.outbound, can_id, data))

    def from_nodes(self, can_id: int, data: bytes) -> None:
        """A node sends."""
        for each_id, each_data in self._pass(NODES, self.inbound, can_id, data):
            self.end.put(each_id, each_data)

    def say(self, can_id: int, data: bytes) -> None:
        """The third station sends, to everybody."""
        if self._busy:
            self.then(lambda: self.say(can_id, data))
            return
        self.frames.append(Frame(self._loop.time(), self.cycle, FOREIGN, can_id, data, arrived=True))
        self.end.put(can_id, data)
        self._hand_over([(can_id, data)])

    def then(self, action: Callable[[], None]) -> None:
        """Do something to the nodes; where a frame is on the bus, behind that."""
        if self._busy:
            self._next.append(action)
        else:
            action()

    def deliver(self, can_id: int, data: bytes) -> None:
        """Something that was kept back arrives at the controller."""
        self.end.put(can_id, data)

    def error(self, error_class: int, data: bytes) -> None:
        """The controller's interface reports an error frame."""
        self.end.put(error_class, data, is_error=True)

    def _hand_over(self, arriving: Passing) -> None:
        """Frames reach the nodes, whose answers go out meanwhile; then it is the third station's turn."""
        if self.nodes_dead:
            return
        outer, self._busy = self._busy, True
        for can_id, data in arriving:
            self.nodes(can_id, data)
        self._busy = outer
        while self._next and not self._busy:
            self._next.popleft()()

    def _pass(
        self, sender: str, fault: Callable[[int, bytes], Passing] | None, can_id: int, data: bytes
    ) -> Passing:
        if self.countdown:
            self.countdown -= 1
            if not self.countdown:
                self.on_zero()
                fault = self.outbound if sender is CONTROLLER else self.inbound
        arriving = [(can_id, data)] if fault is None else fault(can_id, data)
        arrived = (can_id, data) in arriving
        self.frames.append(Frame(self._loop.time(), self.cycle, sender, can_id, data, arrived))
        return arriving


class ControllerEnd:
    """What `servo_ctrl.io.can_port.CanPort` uses of a python-can bus."""

    channel_info = "the campaign's bus"

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._waiting: deque[can.Message] = deque()
        self._file = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._signalled = False

    def put(self, can_id: int, data: bytes, *, is_error: bool = False) -> None:
        """Let a frame wait to be read."""
        if self._file < 0 or self._wire.controller_dead:
            return
        self._waiting.append(
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
        """A file that is readable while frames wait."""
        return self._file

    def recv(self, _timeout: float | None = None) -> can.Message | None:
        """The next frame, or None."""
        if self._wire.failure is not None:
            raise self._wire.failure
        if self._waiting:
            return self._waiting.popleft()
        if self._signalled:
            os.eventfd_read(self._file)
            self._signalled = False
        return None

    def send(self, message: can.Message, _timeout: float | None = None) -> None:
        """Put a frame on the bus."""
        if self._wire.failure is not None:
            raise self._wire.failure
        self._wire.from_controller(message.arbitration_id, bytes(message.data))

    def shutdown(self) -> None:
        """Leave the bus."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


def _nobody(_can_id: int, _data: bytes) -> None:
    """No nodes yet."""


def _nothing() -> None:
    """Nobody counts."""
