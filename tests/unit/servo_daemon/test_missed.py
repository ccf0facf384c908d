"""Ticks and inputs that are missing: what is sailed through, what is too much, in a row and in a thousand."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from ideal_drives import PERIOD_S, Stand, ideal_machine_file

from servo_ctrl.axis.fault_policy import Event, Stage
from servo_ctrl.daemon.missed_ticks import BLOCK_CYCLES, MissedTicks
from servo_ctrl.daemon.missing_inputs import MissingInputs, Tolerance

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize(("missed", "told"), [(1, False), (20, False), (21, True), (500, True)])
def test_gap_is_too_long_beyond_twenty_milliseconds(missed: int, told: bool) -> None:
    ticks = MissedTicks(PERIOD_S, 1000)
    assert ("at one go" in ticks.take(600, missed)) == told
    assert ticks.total == missed


def test_short_gaps_are_too_many_beyond_the_set_number_and_told_once_so_often() -> None:
    ticks = MissedTicks(PERIOD_S, 300)
    told = [cycle for cycle in range(2, 900, 2) if ticks.take(cycle, 1)]
    assert told == [602]  # the 301st
    assert "more than 0 of 1000 ticks" in MissedTicks(PERIOD_S, 0).take(1, 1)


def test_every_block_counts_anew() -> None:
    ticks = MissedTicks(PERIOD_S, 300)
    assert not any(ticks.take(cycle, 1) for cycle in range(4, 40 * BLOCK_CYCLES, 4))


def test_node_is_given_up_for_many_short_gaps_as_for_a_long_one() -> None:
    missing = MissingInputs(2, Tolerance(in_a_row=20, in_a_block=300))
    given_up = []
    for cycle in range(BLOCK_CYCLES):
        if cycle % 2 and missing.count(1, cycle):
            given_up.append(cycle)
        missing.recount([(0,), None if cycle % 2 else (0,)])
    assert given_up[0] == 601
    assert missing.lost == {1}


def test_too_many_missed_ticks_lead_the_axes_to_rest(tmp_path: Path) -> None:
    stand = Stand(ideal_machine_file(tmp_path)).start()
    stand.machine._missed = MissedTicks(PERIOD_S, 30)
    stand.run(6, elapsed=6)
    assert stand.machine.stage is Stage.RUNNING
    stand.run(1, elapsed=6)
    assert stand.machine.stage is Stage.STOPPING
    assert [event for event, _ in stand.faults] == [Event.LATE_TICK]
    assert stand.run(300).machine.stage is Stage.OFF
