"""Repeated, late and wrongly sized frames: their sender, and the age of inputs."""

import pytest
from cycle_dialogue import OTHER, A, B, CycleDialogue, Rx

from servo_ctrl.daemon.cycle.cycle import LATE_CYCLES_MAX, REPEATS_TOLERATED


def test_second_frame_with_other_data_is_a_duplicate_node() -> None:
    dialogue = CycleDialogue(lockstep=False)
    dialogue.cycle.begin()
    dialogue.receive(Rx(0, A), Rx(0, OTHER))
    assert dialogue.anomalies == [("twice", 0)]


def test_repeated_identical_frames_are_reported_once_they_persist() -> None:
    """CAN may deliver a frame twice; two nodes with one id and one position do so in every cycle."""
    dialogue = CycleDialogue(lockstep=False)
    for _ in range(REPEATS_TOLERATED):
        dialogue.cycle.begin()
        dialogue.receive(Rx(0, A), Rx(0, A), Rx(1, B))
    assert dialogue.anomalies == []
    dialogue.cycle.begin()
    dialogue.receive(Rx(0, A), Rx(0, A), Rx(1, B))
    assert dialogue.anomalies == [("twice", 0)]


def test_repeated_frame_in_the_next_cycle_belongs_to_the_same_node() -> None:
    dialogue = CycleDialogue(lockstep=False)
    dialogue.cycle.begin()
    dialogue.receive(Rx(0, A), Rx(1, B))
    dialogue.cycle.begin()
    dialogue.receive(Rx(0, A), Rx(0, OTHER), Rx(1, B))
    assert dialogue.anomalies == []


def test_late_frame_is_no_duplicate() -> None:
    dialogue = CycleDialogue(lockstep=False, give_up_after=5)
    dialogue.cycle.begin()
    dialogue.receive(Rx(1, B))
    dialogue.cycle.begin()
    dialogue.receive(Rx(0, A), Rx(0, OTHER), Rx(1, B))
    assert dialogue.anomalies == []
    dialogue.cycle.begin()
    dialogue.receive(Rx(0, OTHER), Rx(0, A), Rx(1, B))
    assert dialogue.anomalies == [("twice", 0)]


def test_several_late_frames_at_once_are_no_duplicates() -> None:
    """A simulator that was held up for three periods, and answers three SYNCs then."""
    dialogue = CycleDialogue(lockstep=False, give_up_after=9)
    for _ in range(4):
        dialogue.cycle.begin()
        dialogue.receive(Rx(1, B))
    dialogue.receive(Rx(0, A), Rx(0, OTHER), Rx(0, A), Rx(0, OTHER))
    assert dialogue.anomalies == []
    dialogue.cycle.begin()
    dialogue.receive(Rx(0, OTHER), Rx(0, b"\x03\x00"))
    assert dialogue.anomalies == [("twice", 0)]


def test_age_of_inputs_is_the_number_still_queued() -> None:
    dialogue = CycleDialogue(lockstep=False, give_up_after=9)
    for late in range(4):
        assert dialogue.cycle.input_age(0) == max(late - 1, 0)
        dialogue.cycle.begin()
        dialogue.receive(Rx(1, B))
    dialogue.receive(Rx(0, A))
    assert dialogue.cycle.input_age(0) == 3, "that of the first of these cycles"
    dialogue.receive(Rx(0, A), Rx(0, A))
    assert (dialogue.cycle.input_age(0), dialogue.cycle.input_age(1)) == (1, 0)
    for _ in range(LATE_CYCLES_MAX + 1):
        dialogue.cycle.begin()
        dialogue.receive(Rx(0, A), Rx(1, B))
    assert dialogue.cycle.input_age(0) == 0, "the last one was lost"


def test_age_of_inputs_is_bounded_by_the_cycles_in_which_they_may_still_come() -> None:
    dialogue = CycleDialogue(lockstep=False, give_up_after=10**6)
    for _ in range(LATE_CYCLES_MAX + 50):
        dialogue.cycle.begin()
        dialogue.receive(Rx(1, B))
    assert dialogue.cycle.input_age(0) == LATE_CYCLES_MAX


def test_frames_in_transit_when_the_cycle_stops_are_no_duplicates() -> None:
    dialogue = CycleDialogue(lockstep=True)
    dialogue.cycle.begin()
    dialogue.cycle.stop()
    dialogue.receive(Rx(0, A), Rx(1, B))
    assert dialogue.anomalies == []


@pytest.mark.parametrize("payload", [b"", A[:-1], A + b"\x00", bytes(8)])
def test_frame_of_another_length_is_reported_and_ignored(payload: bytes) -> None:
    dialogue = CycleDialogue(lockstep=False)
    dialogue.cycle.begin()
    dialogue.receive(Rx(0, payload), Rx(1, B))
    assert dialogue.anomalies == [(f"{len(payload)} bytes", 0)]
    assert dialogue.cycle.waiting == 1
