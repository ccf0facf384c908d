"""The cycle as a scripted dialogue: what it is given, what it sends, in order. No bus, no clock, no wait."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, NamedTuple

import pytest

from servo_ctrl.daemon.cycle import LATE_WITHIN, REPEATS_TOLERATED, Cycle

if TYPE_CHECKING:
    from servo_ctrl.daemon.cycle import Inputs


class Tx(NamedTuple):
    """A frame that the cycle must send."""

    name: str
    payload: bytes = b""


class Rx(NamedTuple):
    """A frame from a node."""

    node: int
    payload: bytes


class Tick(NamedTuple):
    """What the core must be asked."""

    cycle: int
    elapsed: int
    inputs: tuple[tuple[int, ...] | None, ...]


SYNC = Tx("sync")
A, B = b"\x01\x00", b"\xff\xff\xff\xff"
OTHER = b"\x02\x00"
IN_A, IN_B = (1,), (-1,)


class Scene:
    """A cycle of two nodes and one RPDO, and a log of all it does."""

    def __init__(self, *, lockstep: bool, give_up_after: int = 1, off_at: int = 10**9) -> None:
        self.log: list[Tx | Tick] = []
        self.elapsed: list[int] = []
        self.doubts: list[tuple[str, int]] = []
        self.ended = 0
        self._give_up_after, self._off_at = give_up_after, off_at
        self._missing = [0, 0]
        self.cycle = Cycle(
            self,
            self.sender("sync"),
            [self.sender("rpdo")],
            [struct.Struct("<h"), struct.Struct("<i")],
            lockstep=lockstep,
            on_begin=self.elapsed.append,
            on_end=self._on_end,
        )
        self._handlers = [self.cycle.handler(0), self.cycle.handler(1)]

    def sender(self, name: str) -> Sender:
        return Sender(self.log, name)

    def tick(self, cycle: int, elapsed: int, inputs: Inputs) -> list[bytes] | None:
        self.log.append(Tick(cycle, elapsed, tuple(inputs)))
        return None if cycle >= self._off_at else [bytes([cycle & 0xFF])]

    def input_missing(self, node: int) -> bool:
        self._missing[node] += 1
        return self._missing[node] >= self._give_up_after

    def input_twice(self, node: int) -> None:
        self.doubts.append(("twice", node))

    def input_of_other_length(self, node: int, size: int) -> None:
        self.doubts.append((f"{size} bytes", node))

    def receive(self, *frames: Rx) -> None:
        for node, payload in frames:
            self._handlers[node](bytearray(payload), 0.0)

    def taken(self) -> list[Tx | Tick]:
        log, self.log[:] = list(self.log), []
        return log

    def _on_end(self) -> None:
        self.ended += 1


class Sender:
    """Writes down what is sent."""

    def __init__(self, log: list[Tx | Tick], name: str) -> None:
        self._log, self._name = log, name

    def send(self, payload: bytes) -> None:
        self._log.append(Tx(self._name, payload))


def test_lockstep_sends_the_next_sync_behind_the_rpdos() -> None:
    scene = Scene(lockstep=True)
    scene.cycle.begin()
    assert scene.taken() == [SYNC]
    scene.receive(Rx(0, A))
    assert scene.taken() == []
    scene.receive(Rx(1, B))
    assert scene.taken() == [Tick(0, 1, (IN_A, IN_B)), Tx("rpdo", b"\x00"), SYNC]
    scene.receive(Rx(1, B), Rx(0, A))
    assert scene.taken() == [Tick(1, 1, (IN_A, IN_B)), Tx("rpdo", b"\x01"), SYNC]


def test_real_time_waits_for_the_clock() -> None:
    scene = Scene(lockstep=False)
    scene.cycle.begin(1)
    scene.receive(Rx(0, A), Rx(1, B))
    assert scene.taken() == [SYNC, Tick(0, 1, (IN_A, IN_B)), Tx("rpdo", b"\x00")]
    scene.cycle.begin(1)
    assert scene.taken() == [SYNC]


def test_missed_ticks_count_as_cycles_but_send_one_sync() -> None:
    scene = Scene(lockstep=False)
    scene.cycle.begin(1)
    scene.receive(Rx(0, A), Rx(1, B))
    scene.taken()
    scene.cycle.begin(4)
    scene.receive(Rx(0, A), Rx(1, B))
    assert scene.taken() == [SYNC, Tick(4, 4, (IN_A, IN_B)), Tx("rpdo", b"\x04")]
    assert scene.elapsed == [1, 4]


def test_cycle_that_is_still_open_is_settled_without_its_inputs_before_the_next() -> None:
    scene = Scene(lockstep=False, give_up_after=3)
    scene.cycle.begin(1)
    scene.receive(Rx(1, B))
    scene.cycle.begin(1)
    assert scene.taken() == [SYNC, Tick(0, 1, (None, IN_B)), Tx("rpdo", b"\x00"), SYNC]


def test_node_that_is_given_up_is_not_waited_for_any_more() -> None:
    scene = Scene(lockstep=True)
    scene.cycle.begin()
    scene.receive(Rx(1, B))
    scene.cycle.complete_without()
    assert scene.taken() == [SYNC, Tick(0, 1, (None, IN_B)), Tx("rpdo", b"\x00"), SYNC]
    scene.receive(Rx(1, B))
    assert scene.taken() == [Tick(1, 1, (None, IN_B)), Tx("rpdo", b"\x01"), SYNC]


@pytest.mark.parametrize("frame", [Rx(0, b"\x01"), Rx(0, b"\x01\x00\x00"), Rx(0, b"")])
def test_frame_of_another_length_is_no_input(frame: Rx) -> None:
    scene = Scene(lockstep=True)
    scene.cycle.begin()
    scene.receive(frame, Rx(1, B))
    assert scene.taken() == [SYNC]
    assert scene.cycle.waiting == 0b01


def test_second_frame_of_a_node_in_one_cycle_is_ignored() -> None:
    scene = Scene(lockstep=True)
    scene.cycle.begin()
    scene.receive(Rx(0, A), Rx(0, b"\x09\x00"), Rx(1, B))
    assert scene.taken()[1] == Tick(0, 1, (IN_A, IN_B))


def test_frame_outside_a_cycle_is_ignored() -> None:
    scene = Scene(lockstep=False)
    scene.receive(Rx(0, A), Rx(1, B))
    assert scene.taken() == []


def test_core_that_is_off_ends_the_cycle_without_another_frame() -> None:
    scene = Scene(lockstep=True, off_at=0)
    scene.cycle.begin()
    scene.receive(Rx(0, A), Rx(1, B))
    assert scene.taken() == [SYNC, Tick(0, 1, (IN_A, IN_B))]
    assert (scene.cycle.running, scene.ended) == (False, 1)
    scene.cycle.begin()
    scene.cycle.stop()
    assert (scene.taken(), scene.ended) == ([], 1)


def test_node_that_is_heard_again_can_be_expected_again() -> None:
    scene = Scene(lockstep=True)
    scene.cycle.begin()
    scene.receive(Rx(1, B))
    scene.cycle.complete_without()
    assert not scene.cycle.hears(0)
    scene.receive(Rx(0, b"\x01"))
    assert not scene.cycle.hears(0), "half a frame is no answer"
    scene.receive(Rx(0, A), Rx(1, B))
    assert scene.cycle.hears(0)
    scene.cycle.expect(0)
    scene.receive(Rx(1, B))  # this SYNC was not meant for it
    scene.taken()
    scene.receive(Rx(1, B))
    assert scene.taken() == []
    scene.receive(Rx(0, A))
    assert scene.taken()[0] == Tick(3, 1, (IN_A, IN_B))


def test_node_that_has_fallen_silent_is_not_heard() -> None:
    scene = Scene(lockstep=True)
    scene.cycle.begin()
    scene.receive(Rx(1, B))
    scene.cycle.complete_without()
    scene.receive(Rx(0, A))
    for _ in range(3):
        assert scene.cycle.hears(0)
        scene.receive(Rx(1, B))
    assert not scene.cycle.hears(0)


@pytest.mark.parametrize("lockstep", [True, False])
def test_cycle_goes_on_when_no_node_is_left(lockstep: bool) -> None:
    scene = Scene(lockstep=lockstep)
    scene.cycle.begin()
    scene.cycle.complete_without()
    if not lockstep:
        scene.cycle.begin()
    scene.taken()
    assert (scene.cycle.open, scene.cycle.waiting) == (True, 0)
    if lockstep:
        scene.cycle.complete_without()
    else:
        scene.cycle.begin()
    assert scene.taken() == [Tick(1, 1, (None, None)), Tx("rpdo", b"\x01"), SYNC]


def test_second_frame_that_says_something_else_is_another_nodes() -> None:
    scene = Scene(lockstep=False)
    scene.cycle.begin()
    scene.receive(Rx(0, A), Rx(0, OTHER))
    assert scene.doubts == [("twice", 0)]


def test_frame_that_comes_twice_is_told_once_it_does_so_again_and_again() -> None:
    """CAN may deliver a frame twice; two nodes with one id and one position do so in every cycle."""
    scene = Scene(lockstep=False)
    for _ in range(REPEATS_TOLERATED):
        scene.cycle.begin()
        scene.receive(Rx(0, A), Rx(0, A), Rx(1, B))
    assert scene.doubts == []
    scene.cycle.begin()
    scene.receive(Rx(0, A), Rx(0, A), Rx(1, B))
    assert scene.doubts == [("twice", 0)]


def test_repeated_frame_that_falls_into_the_next_cycle_is_still_one_of_the_same_node() -> None:
    scene = Scene(lockstep=False)
    scene.cycle.begin()
    scene.receive(Rx(0, A), Rx(1, B))
    scene.cycle.begin()
    scene.receive(Rx(0, A), Rx(0, OTHER), Rx(1, B))
    assert scene.doubts == []


def test_frame_that_comes_late_is_not_another_nodes() -> None:
    scene = Scene(lockstep=False, give_up_after=5)
    scene.cycle.begin()
    scene.receive(Rx(1, B))
    scene.cycle.begin()
    scene.receive(Rx(0, A), Rx(0, OTHER), Rx(1, B))
    assert scene.doubts == []
    scene.cycle.begin()
    scene.receive(Rx(0, OTHER), Rx(0, A), Rx(1, B))
    assert scene.doubts == [("twice", 0)]


def test_frames_that_come_late_all_at_once_are_not_another_nodes() -> None:
    """A simulator that was held up for three periods, and answers three SYNCs then."""
    scene = Scene(lockstep=False, give_up_after=9)
    for _ in range(4):
        scene.cycle.begin()
        scene.receive(Rx(1, B))
    scene.receive(Rx(0, A), Rx(0, OTHER), Rx(0, A), Rx(0, OTHER))
    assert scene.doubts == []
    scene.cycle.begin()
    scene.receive(Rx(0, OTHER), Rx(0, b"\x03\x00"))
    assert scene.doubts == [("twice", 0)]


def test_inputs_are_as_old_as_there_are_more_of_them_on_their_way() -> None:
    scene = Scene(lockstep=False, give_up_after=9)
    for late in range(4):
        assert scene.cycle.age(0) == max(late - 1, 0)
        scene.cycle.begin()
        scene.receive(Rx(1, B))
    scene.receive(Rx(0, A))
    assert scene.cycle.age(0) == 3, "that of the first of these cycles"
    scene.receive(Rx(0, A), Rx(0, A))
    assert (scene.cycle.age(0), scene.cycle.age(1)) == (1, 0)
    for _ in range(LATE_WITHIN + 1):
        scene.cycle.begin()
        scene.receive(Rx(0, A), Rx(1, B))
    assert scene.cycle.age(0) == 0, "the last one was lost"


def test_inputs_that_are_lost_again_and_again_make_none_older_than_what_may_still_come() -> None:
    scene = Scene(lockstep=False, give_up_after=10**6)
    for _ in range(LATE_WITHIN + 50):
        scene.cycle.begin()
        scene.receive(Rx(1, B))
    assert scene.cycle.age(0) == LATE_WITHIN


def test_frames_on_their_way_when_the_cycle_stops_are_nobody_elses() -> None:
    scene = Scene(lockstep=True)
    scene.cycle.begin()
    scene.cycle.stop()
    scene.receive(Rx(0, A), Rx(1, B))
    assert scene.doubts == []


@pytest.mark.parametrize("payload", [b"", A[:-1], A + b"\x00", bytes(8)])
def test_frame_of_another_length_is_doubted_and_not_taken(payload: bytes) -> None:
    scene = Scene(lockstep=False)
    scene.cycle.begin()
    scene.receive(Rx(0, payload), Rx(1, B))
    assert scene.doubts == [(f"{len(payload)} bytes", 0)]
    assert scene.cycle.waiting == 1
