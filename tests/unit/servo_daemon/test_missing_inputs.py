"""Missing inputs: each node is lost separately, after cycles in a row or many in a block."""

from servo_ctrl.daemon.cycle.missed_ticks import BLOCK_CYCLES
from servo_ctrl.daemon.cycle.missing_inputs import MissingInputs, Tolerance

HERE = (0,)


def test_node_is_lost_after_many_short_gaps_as_after_a_long_one() -> None:
    missing = MissingInputs(2, Tolerance(consecutive=20, per_block=300))
    given_up = []
    for cycle in range(BLOCK_CYCLES):
        if cycle % 2 and missing.count(1, cycle):
            given_up.append(cycle)
        missing.recount([HERE, None if cycle % 2 else HERE])
    assert given_up[0] == 601  # the 301st
    assert missing.lost == {1}
    assert missing.total == BLOCK_CYCLES // 2


def test_node_is_lost_in_the_first_cycle_beyond_the_tolerated_row() -> None:
    missing = MissingInputs(2, Tolerance(consecutive=3, per_block=300))
    for cycle in range(3):
        assert not missing.count(0, cycle)
        missing.recount([None, HERE])
    assert not missing.lost
    assert missing.count(0, 3)
    assert missing.lost == {0}


def test_inputs_that_come_end_the_row_of_their_node_alone() -> None:
    missing = MissingInputs(2, Tolerance(consecutive=1, per_block=300))
    assert not missing.count(0, 0)
    assert not missing.count(1, 0)
    missing.recount([HERE, None])
    assert not missing.count(0, 1)
    assert missing.count(1, 1)
    assert missing.lost == {1}


def test_with_zero_tolerance_every_missing_input_counts() -> None:
    assert MissingInputs(1, Tolerance(consecutive=0, per_block=300)).count(0, 0)
    assert MissingInputs(1, Tolerance(consecutive=300, per_block=0)).count(0, 0)


def test_it_shows_whether_inputs_are_missing_now() -> None:
    missing = MissingInputs(2, Tolerance(consecutive=20, per_block=300))
    shown = [missing.any]
    missing.count(0, 0)
    missing.count(1, 0)
    shown.append(missing.any)
    for inputs in ([HERE, None], [None, HERE]):
        missing.recount(inputs)
        shown.append(missing.any)
    assert shown == [False, True, True, False]


def test_a_cycle_without_several_inputs_counts_once() -> None:
    missing = MissingInputs(2, Tolerance(consecutive=20, per_block=300))
    for node, cycle in ((0, 4), (1, 4), (1, 5)):
        missing.count(node, cycle)
    assert (missing.total, missing.cycles) == (3, 2)
