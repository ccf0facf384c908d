"""A cycle in a scripted dialogue of received and sent frames. No bus, no clock, no wait."""

from __future__ import annotations

from typing import NamedTuple

from servo_ctrl.daemon.cycle.cycle import Cycle, Inputs


class Tx(NamedTuple):
    """A frame that the cycle must send."""

    name: str
    payload: bytes = b""


class Rx(NamedTuple):
    """A frame from a node."""

    node: int
    payload: bytes


class Tick(NamedTuple):
    """A call that the cycle must make on the machine."""

    cycle: int
    elapsed: int
    inputs: tuple[bytes | bytearray | None, ...]


SYNC = Tx("sync")
A, B = b"\x01\x00", b"\xff\xff\xff\xff"
OTHER = b"\x02\x00"
IN_A, IN_B = A, B


class CycleDialogue:
    """A cycle of two nodes and one RPDO, and a log of all it does."""

    def __init__(self, *, lockstep: bool, give_up_after: int = 1, off_at: int = 10**9) -> None:
        self.log: list[Tx | Tick] = []
        self._burst: list[Tx] = []
        self.elapsed: list[int] = []
        self.anomalies: list[tuple[str, int]] = []
        self.ended = 0
        self.arrived: list[Rx] = []
        """Frames that have arrived and are not read yet."""
        self._give_up_after, self._off_at = give_up_after, off_at
        self._missing = [0, 0]
        self.cycle = Cycle(
            self,
            self.sender("sync"),
            [self.sender("rpdo")],
            [2, 4],
            self._flush,
            self._read,
            lockstep=lockstep,
            on_begin=self.elapsed.append,
            on_end=self._on_end,
        )
        self._handlers = [self.cycle.handler(0), self.cycle.handler(1)]

    def sender(self, name: str) -> Sender:
        return Sender(self._burst, name)

    def tick(self, cycle: int, elapsed: int, inputs: Inputs) -> list[bytes] | None:
        self.log.append(Tick(cycle, elapsed, tuple(inputs)))
        return None if cycle >= self._off_at else [bytes([cycle & 0xFF])]

    def input_missing(self, node: int) -> bool:
        self._missing[node] += 1
        return self._missing[node] >= self._give_up_after

    def duplicate_input(self, node: int) -> None:
        self.anomalies.append(("twice", node))

    def wrong_input_length(self, node: int, size: int) -> None:
        self.anomalies.append((f"{size} bytes", node))

    def receive(self, *frames: Rx) -> None:
        for node, payload in frames:
            self._handlers[node](bytearray(payload), 0.0)

    def take_log(self) -> list[Tx | Tick]:
        log, self.log[:] = list(self.log), []
        return log

    def _flush(self) -> None:
        self.log += self._burst
        self._burst.clear()

    def _read(self) -> None:
        arrived, self.arrived[:] = list(self.arrived), []
        self.receive(*arrived)

    def _on_end(self) -> None:
        self.ended += 1


class Sender:
    """Keeps the frames of a burst until they are sent together."""

    def __init__(self, burst: list[Tx], name: str) -> None:
        self._burst, self._name = burst, name

    def send(self, payload: bytes) -> None:
        self._burst.append(Tx(self._name, payload))
