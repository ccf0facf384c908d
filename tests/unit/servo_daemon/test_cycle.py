"""The cycle as a scripted dialogue: what it is given, what it sends, in order."""

import pytest
from cycle_dialogue import IN_A, IN_B, SYNC, A, B, CycleDialogue, Rx, Tick, Tx


def test_lockstep_sends_the_next_sync_behind_the_rpdos() -> None:
    scene = CycleDialogue(lockstep=True)
    scene.cycle.begin()
    assert scene.taken() == [SYNC]
    scene.receive(Rx(0, A))
    assert scene.taken() == []
    scene.receive(Rx(1, B))
    assert scene.taken() == [Tick(0, 1, (IN_A, IN_B)), Tx("rpdo", b"\x00"), SYNC]
    scene.receive(Rx(1, B), Rx(0, A))
    assert scene.taken() == [Tick(1, 1, (IN_A, IN_B)), Tx("rpdo", b"\x01"), SYNC]


def test_real_time_waits_for_the_clock() -> None:
    scene = CycleDialogue(lockstep=False)
    scene.cycle.begin(1)
    scene.receive(Rx(0, A), Rx(1, B))
    assert scene.taken() == [SYNC, Tick(0, 1, (IN_A, IN_B)), Tx("rpdo", b"\x00")]
    scene.cycle.begin(1)
    assert scene.taken() == [SYNC]


def test_missed_ticks_count_as_cycles_but_send_one_sync() -> None:
    scene = CycleDialogue(lockstep=False)
    scene.cycle.begin(1)
    scene.receive(Rx(0, A), Rx(1, B))
    scene.taken()
    scene.cycle.begin(4)
    scene.receive(Rx(0, A), Rx(1, B))
    assert scene.taken() == [SYNC, Tick(4, 4, (IN_A, IN_B)), Tx("rpdo", b"\x04")]
    assert scene.elapsed == [1, 4]


def test_cycle_that_is_still_open_is_settled_without_its_inputs_before_the_next() -> None:
    scene = CycleDialogue(lockstep=False, give_up_after=3)
    scene.cycle.begin(1)
    scene.receive(Rx(1, B))
    scene.cycle.begin(1)
    assert scene.taken() == [SYNC, Tick(0, 1, (None, IN_B)), Tx("rpdo", b"\x00"), SYNC]


def test_node_that_is_given_up_is_not_waited_for_any_more() -> None:
    scene = CycleDialogue(lockstep=True)
    scene.cycle.begin()
    scene.receive(Rx(1, B))
    scene.cycle.complete_without()
    assert scene.taken() == [SYNC, Tick(0, 1, (None, IN_B)), Tx("rpdo", b"\x00"), SYNC]
    scene.receive(Rx(1, B))
    assert scene.taken() == [Tick(1, 1, (None, IN_B)), Tx("rpdo", b"\x01"), SYNC]


@pytest.mark.parametrize("frame", [Rx(0, b"\x01"), Rx(0, b"\x01\x00\x00"), Rx(0, b"")])
def test_frame_of_another_length_is_no_input(frame: Rx) -> None:
    scene = CycleDialogue(lockstep=True)
    scene.cycle.begin()
    scene.receive(frame, Rx(1, B))
    assert scene.taken() == [SYNC]
    assert scene.cycle.waiting == 0b01


def test_second_frame_of_a_node_in_one_cycle_is_ignored() -> None:
    scene = CycleDialogue(lockstep=True)
    scene.cycle.begin()
    scene.receive(Rx(0, A), Rx(0, b"\x09\x00"), Rx(1, B))
    assert scene.taken()[1] == Tick(0, 1, (IN_A, IN_B))


def test_frame_outside_a_cycle_is_ignored() -> None:
    scene = CycleDialogue(lockstep=False)
    scene.receive(Rx(0, A), Rx(1, B))
    assert scene.taken() == []


def test_core_that_is_off_ends_the_cycle_without_another_frame() -> None:
    scene = CycleDialogue(lockstep=True, off_at=0)
    scene.cycle.begin()
    scene.receive(Rx(0, A), Rx(1, B))
    assert scene.taken() == [SYNC, Tick(0, 1, (IN_A, IN_B))]
    assert (scene.cycle.running, scene.ended) == (False, 1)
    scene.cycle.begin()
    scene.cycle.stop()
    assert (scene.taken(), scene.ended) == ([], 1)


def test_node_that_is_heard_again_can_be_expected_again() -> None:
    scene = CycleDialogue(lockstep=True)
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
    scene = CycleDialogue(lockstep=True)
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
    scene = CycleDialogue(lockstep=lockstep)
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
