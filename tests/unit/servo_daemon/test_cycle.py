"""The cycle as a scripted dialogue of received and sent frames, in order."""

import pytest
from cycle_dialogue import IN_A, IN_B, SYNC, A, B, CycleDialogue, Rx, Tick, Tx


def test_lockstep_sends_the_next_sync_behind_the_rpdos() -> None:
    dialogue = CycleDialogue(lockstep=True)
    dialogue.cycle.begin()
    assert dialogue.take_log() == [SYNC]
    dialogue.receive(Rx(0, A))
    assert dialogue.take_log() == []
    dialogue.receive(Rx(1, B))
    assert dialogue.take_log() == [Tick(0, 1, (IN_A, IN_B)), Tx("rpdo", b"\x00"), SYNC]
    dialogue.receive(Rx(1, B), Rx(0, A))
    assert dialogue.take_log() == [Tick(1, 1, (IN_A, IN_B)), Tx("rpdo", b"\x01"), SYNC]


def test_real_time_waits_for_the_clock() -> None:
    dialogue = CycleDialogue(lockstep=False)
    dialogue.cycle.begin(1)
    dialogue.receive(Rx(0, A), Rx(1, B))
    assert dialogue.take_log() == [SYNC, Tick(0, 1, (IN_A, IN_B)), Tx("rpdo", b"\x00")]
    dialogue.cycle.begin(1)
    assert dialogue.take_log() == [SYNC]


def test_missed_ticks_count_as_cycles_but_send_one_sync() -> None:
    dialogue = CycleDialogue(lockstep=False)
    dialogue.cycle.begin(1)
    dialogue.receive(Rx(0, A), Rx(1, B))
    dialogue.take_log()
    dialogue.cycle.begin(4)
    dialogue.receive(Rx(0, A), Rx(1, B))
    assert dialogue.take_log() == [SYNC, Tick(4, 4, (IN_A, IN_B)), Tx("rpdo", b"\x04")]
    assert dialogue.elapsed == [1, 4]


def test_open_cycle_is_completed_without_its_inputs_before_the_next() -> None:
    dialogue = CycleDialogue(lockstep=False, give_up_after=3)
    dialogue.cycle.begin(1)
    dialogue.receive(Rx(1, B))
    dialogue.cycle.begin(1)
    assert dialogue.take_log() == [SYNC, Tick(0, 1, (None, IN_B)), Tx("rpdo", b"\x00"), SYNC]


def test_inputs_that_have_arrived_unread_when_the_next_cycle_is_due_are_in_time() -> None:
    dialogue = CycleDialogue(lockstep=False, give_up_after=3)
    dialogue.cycle.begin(1)
    dialogue.arrived += [Rx(0, A), Rx(1, B)]
    dialogue.cycle.begin(1)
    assert dialogue.take_log() == [SYNC, Tick(0, 1, (IN_A, IN_B)), Tx("rpdo", b"\x00"), SYNC]


def test_cycle_does_not_wait_for_a_lost_node() -> None:
    dialogue = CycleDialogue(lockstep=True)
    dialogue.cycle.begin()
    dialogue.receive(Rx(1, B))
    dialogue.cycle.complete_without_missing()
    assert dialogue.take_log() == [SYNC, Tick(0, 1, (None, IN_B)), Tx("rpdo", b"\x00"), SYNC]
    dialogue.receive(Rx(1, B))
    assert dialogue.take_log() == [Tick(1, 1, (None, IN_B)), Tx("rpdo", b"\x01"), SYNC]


@pytest.mark.parametrize("frame", [Rx(0, b"\x01"), Rx(0, b"\x01\x00\x00"), Rx(0, b"")])
def test_frame_of_another_length_is_no_input(frame: Rx) -> None:
    dialogue = CycleDialogue(lockstep=True)
    dialogue.cycle.begin()
    dialogue.receive(frame, Rx(1, B))
    assert dialogue.take_log() == [SYNC]
    assert dialogue.cycle.waiting == 0b01


def test_second_frame_of_a_node_in_one_cycle_is_ignored() -> None:
    dialogue = CycleDialogue(lockstep=True)
    dialogue.cycle.begin()
    dialogue.receive(Rx(0, A), Rx(0, b"\x09\x00"), Rx(1, B))
    assert dialogue.take_log()[1] == Tick(0, 1, (IN_A, IN_B))


def test_frame_outside_a_cycle_is_ignored() -> None:
    dialogue = CycleDialogue(lockstep=False)
    dialogue.receive(Rx(0, A), Rx(1, B))
    assert dialogue.take_log() == []


def test_machine_off_ends_the_cycle_without_another_frame() -> None:
    dialogue = CycleDialogue(lockstep=True, off_at=0)
    dialogue.cycle.begin()
    dialogue.receive(Rx(0, A), Rx(1, B))
    assert dialogue.take_log() == [SYNC, Tick(0, 1, (IN_A, IN_B))]
    assert (dialogue.cycle.running, dialogue.ended) == (False, 1)
    dialogue.cycle.begin()
    dialogue.cycle.stop()
    assert (dialogue.take_log(), dialogue.ended) == ([], 1)


def test_returning_node_can_be_awaited_again() -> None:
    dialogue = CycleDialogue(lockstep=True)
    dialogue.cycle.begin()
    dialogue.receive(Rx(1, B))
    dialogue.cycle.complete_without_missing()
    assert not dialogue.cycle.responding(0)
    dialogue.receive(Rx(0, b"\x01"))
    assert not dialogue.cycle.responding(0), "half a frame is not an answer"
    dialogue.receive(Rx(0, A), Rx(1, B))
    assert dialogue.cycle.responding(0)
    dialogue.cycle.expect(0)
    dialogue.receive(Rx(1, B))  # this SYNC was not meant for it
    dialogue.take_log()
    dialogue.receive(Rx(1, B))
    assert dialogue.take_log() == []
    dialogue.receive(Rx(0, A))
    assert dialogue.take_log()[0] == Tick(3, 1, (IN_A, IN_B))


def test_silent_node_is_not_counted_as_responding() -> None:
    dialogue = CycleDialogue(lockstep=True)
    dialogue.cycle.begin()
    dialogue.receive(Rx(1, B))
    dialogue.cycle.complete_without_missing()
    dialogue.receive(Rx(0, A))
    for _ in range(3):
        assert dialogue.cycle.responding(0)
        dialogue.receive(Rx(1, B))
    assert not dialogue.cycle.responding(0)


@pytest.mark.parametrize("lockstep", [True, False])
def test_cycle_goes_on_when_no_node_is_left(lockstep: bool) -> None:
    dialogue = CycleDialogue(lockstep=lockstep)
    dialogue.cycle.begin()
    dialogue.cycle.complete_without_missing()
    if not lockstep:
        dialogue.cycle.begin()
    dialogue.take_log()
    assert (dialogue.cycle.open, dialogue.cycle.waiting) == (True, 0)
    if lockstep:
        dialogue.cycle.complete_without_missing()
    else:
        dialogue.cycle.begin()
    assert dialogue.take_log() == [Tick(1, 1, (None, None)), Tx("rpdo", b"\x01"), SYNC]
