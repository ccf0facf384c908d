"""Frames that come twice, late or in another length: whose they are, and how old the inputs are."""

import pytest
from cycle_dialogue import OTHER, A, B, CycleDialogue, Rx

from servo_ctrl.daemon.cycle.cycle import LATE_WITHIN, REPEATS_TOLERATED


def test_second_frame_that_says_something_else_is_another_nodes() -> None:
    scene = CycleDialogue(lockstep=False)
    scene.cycle.begin()
    scene.receive(Rx(0, A), Rx(0, OTHER))
    assert scene.doubts == [("twice", 0)]


def test_frame_that_comes_twice_is_told_once_it_does_so_again_and_again() -> None:
    """CAN may deliver a frame twice; two nodes with one id and one position do so in every cycle."""
    scene = CycleDialogue(lockstep=False)
    for _ in range(REPEATS_TOLERATED):
        scene.cycle.begin()
        scene.receive(Rx(0, A), Rx(0, A), Rx(1, B))
    assert scene.doubts == []
    scene.cycle.begin()
    scene.receive(Rx(0, A), Rx(0, A), Rx(1, B))
    assert scene.doubts == [("twice", 0)]


def test_repeated_frame_that_falls_into_the_next_cycle_is_still_one_of_the_same_node() -> None:
    scene = CycleDialogue(lockstep=False)
    scene.cycle.begin()
    scene.receive(Rx(0, A), Rx(1, B))
    scene.cycle.begin()
    scene.receive(Rx(0, A), Rx(0, OTHER), Rx(1, B))
    assert scene.doubts == []


def test_frame_that_comes_late_is_not_another_nodes() -> None:
    scene = CycleDialogue(lockstep=False, give_up_after=5)
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
    scene = CycleDialogue(lockstep=False, give_up_after=9)
    for _ in range(4):
        scene.cycle.begin()
        scene.receive(Rx(1, B))
    scene.receive(Rx(0, A), Rx(0, OTHER), Rx(0, A), Rx(0, OTHER))
    assert scene.doubts == []
    scene.cycle.begin()
    scene.receive(Rx(0, OTHER), Rx(0, b"\x03\x00"))
    assert scene.doubts == [("twice", 0)]


def test_inputs_are_as_old_as_there_are_more_of_them_on_their_way() -> None:
    scene = CycleDialogue(lockstep=False, give_up_after=9)
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
    scene = CycleDialogue(lockstep=False, give_up_after=10**6)
    for _ in range(LATE_WITHIN + 50):
        scene.cycle.begin()
        scene.receive(Rx(1, B))
    assert scene.cycle.age(0) == LATE_WITHIN


def test_frames_on_their_way_when_the_cycle_stops_are_nobody_elses() -> None:
    scene = CycleDialogue(lockstep=True)
    scene.cycle.begin()
    scene.cycle.stop()
    scene.receive(Rx(0, A), Rx(1, B))
    assert scene.doubts == []


@pytest.mark.parametrize("payload", [b"", A[:-1], A + b"\x00", bytes(8)])
def test_frame_of_another_length_is_doubted_and_not_taken(payload: bytes) -> None:
    scene = CycleDialogue(lockstep=False)
    scene.cycle.begin()
    scene.receive(Rx(0, payload), Rx(1, B))
    assert scene.doubts == [(f"{len(payload)} bytes", 0)]
    assert scene.cycle.waiting == 1
