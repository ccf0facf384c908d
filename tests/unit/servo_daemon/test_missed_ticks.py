"""Missed ticks: which are tolerated, and which are too many, in one gap or in a block."""

from pathlib import Path

import pytest
from ideal_drives import PERIOD_S, Stand, ideal_machine_file

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.commands.stage import Stage
from servo_ctrl.daemon.cycle.missed_ticks import BLOCK_CYCLES, MissedTicks


@pytest.mark.parametrize(("missed", "reported"), [(1, False), (20, False), (21, True), (500, True)])
def test_gap_is_too_long_beyond_twenty_milliseconds(missed: int, reported: bool) -> None:
    ticks = MissedTicks(PERIOD_S, 1000)
    assert (f"{missed} consecutive ticks were missed" in ticks.count(600, missed)) == reported
    assert ticks.total == missed


def test_gap_is_measured_in_time_and_not_in_ticks() -> None:
    assert not MissedTicks(4 * PERIOD_S, 1000).count(600, 5)
    assert MissedTicks(4 * PERIOD_S, 1000).count(600, 6)


def test_short_gaps_are_too_many_beyond_the_set_number() -> None:
    ticks = MissedTicks(PERIOD_S, 300)
    reported = [cycle for cycle in range(2, 900, 2) if ticks.count(cycle, 1)]
    assert reported == [602]  # the 301st
    assert ticks.total == 449
    assert "more than 0 of 1000 ticks" in MissedTicks(PERIOD_S, 0).count(1, 1)


def test_reported_missed_ticks_are_not_counted_again() -> None:
    ticks = MissedTicks(PERIOD_S, 300)
    assert [cycle for cycle in range(1, BLOCK_CYCLES) if ticks.count(cycle, 1)] == [301, 602, 903]


def test_every_block_counts_from_zero() -> None:
    ticks = MissedTicks(PERIOD_S, 300)
    assert not any(ticks.count(cycle, 1) for cycle in range(4, 40 * BLOCK_CYCLES, 4))


def test_block_ends_with_its_last_tick() -> None:
    """One miss in the last tick of a block and two in the first of the next are not three."""
    ticks = MissedTicks(PERIOD_S, 2)
    assert not ticks.count(2999, 1)
    assert not ticks.count(3000, 2)
    assert "more than 2 of 1000" in ticks.count(3999, 1)


@pytest.mark.parametrize("begin", [0, BLOCK_CYCLES, 3600 * BLOCK_CYCLES])
def test_count_begins_at_nothing_whenever_the_first_one_is_missed(begin: int) -> None:
    ticks = MissedTicks(PERIOD_S, 2)
    assert [bool(ticks.count(begin + at, 1)) for at in range(3)] == [False, False, True]


def test_too_many_missed_ticks_stop_the_axes(tmp_path: Path) -> None:
    stand = Stand(ideal_machine_file(tmp_path)).start()
    stand.machine._missed = MissedTicks(PERIOD_S, 30)
    stand.run(6, elapsed=6)
    assert stand.machine.stage is Stage.RUNNING
    stand.run(1, elapsed=6)
    assert stand.machine.stage is Stage.STOPPING
    assert [event for event, _ in stand.faults] == [Event.LATE_TICK]
    assert stand.run(300).machine.stage is Stage.OFF
