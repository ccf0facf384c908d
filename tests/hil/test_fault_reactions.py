"""Fault policy in lockstep: faults of an axis, and enabling again afterwards."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fault_bench import BRAKE, COLUMN, POWER_OFF, SHARED, FaultBench
from fault_reaction import FAULT_CYCLE, FAULT_TIME_S, LAST_CYCLE, XY_TABLE, X, Y, assert_reaction_in_time
from machine_files import text_of, write_controller

from servo_ctrl.axis.fault_bounds import BOUND_CYCLES, detection_cycles
from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.commands.stage import Stage


@pytest.fixture
def table_with(tmp_path: Path) -> Callable[..., Path]:
    """The X-Y table with texts of its machine file replaced."""

    def make(**replacements: str) -> Path:
        return write_controller(tmp_path, text_of(XY_TABLE / "controller.toml", replacements)).parent

    return make


# --- faults of an axis ----------------------------------------------------------------------------------


def test_broken_scale_makes_the_drives_brake_before_the_following_error_would() -> None:
    bench = FaultBench(XY_TABLE, f"broken_scale:x@{FAULT_TIME_S}").run(LAST_CYCLE)
    assert_reaction_in_time(bench, Event.SENSORS_DISAGREE, since=apart_since(bench))
    assert Event.FOLLOWING_ERROR not in {event for _, event in bench.events}
    assert "encoder and scale are" in bench.machine.reason
    assert bench.emcy() == [0x7320]
    assert bench.at_rest(0)
    assert bench.at_rest(1)


def apart_since(bench: FaultBench) -> int:
    """The first cycle in which encoder and scale of axis x are further apart than allowed."""
    motor, scale = (SHARED + COLUMN[name] for name in ("motor_position_m", "scale_position_m"))
    return next(int(row[1]) for row in bench.rows if abs(row[motor] - row[scale]) > 0.5e-3)


def test_slipped_coupling_makes_the_drives_brake() -> None:
    bench = FaultBench(XY_TABLE, f"slipped_coupling:x@{FAULT_TIME_S}").run(LAST_CYCLE)
    assert_reaction_in_time(bench, Event.SENSORS_DISAGREE, since=apart_since(bench))


def runs_away_since(bench: FaultBench, start: int) -> int:
    """The first cycle in which axis x moves away from its set point, against a quarter of its force."""
    force, velocity, error = (
        SHARED + COLUMN[name] for name in ("force_command_n", "motor_velocity_m_s", "position_error_m")
    )
    return next(
        int(row[1])
        for row in bench.rows
        if row[1] >= start
        and abs(row[force]) >= 0.25 * 600.0
        and row[force] * row[error] > 0.0
        and row[force] * row[velocity] < 0.0
    )


def test_axis_that_runs_away_loses_its_power_and_the_other_brakes() -> None:
    bench = FaultBench(XY_TABLE, f"runaway_sign:x@{FAULT_TIME_S}").run(LAST_CYCLE)
    runaway = bench.noted(Event.RUNAWAY)
    seen_within = detection_cycles(bench.config, lockstep=True)[Event.RUNAWAY]
    assert 0 <= runaway - runs_away_since(bench, FAULT_CYCLE) <= seen_within
    later = [word for cycle, node, word in bench.controlwords if node == X and cycle > runaway]
    assert later
    assert set(later) == {POWER_OFF}
    assert bench.reacted(Y, BRAKE) - runaway <= BOUND_CYCLES[Event.RUNAWAY]
    assert bench.at_rest(1)
    assert bench.off


def test_wrong_sign_at_a_standstill_is_found_before_the_following_error() -> None:
    bench = FaultBench(XY_TABLE, "runaway_sign:x@0.03").run(LAST_CYCLE)
    assert bench.machine.reason.startswith("axis x: runs away from its set point")
    seen_within = detection_cycles(bench.config, lockstep=True)[Event.RUNAWAY]
    assert 0 <= bench.noted(Event.RUNAWAY) - runs_away_since(bench, 0) <= seen_within
    assert Event.FOLLOWING_ERROR not in {event for _, event in bench.events}
    moved_mm = abs(np.array(bench.truth_m)[:, 0]).max() * 1e3
    assert moved_mm < 10.0


def test_jammed_axis_saturates_and_both_are_stopped_with_a_ramp(table_with: Any) -> None:
    tolerant = "following_error_mm = 50.0\nsaturation_ms = 50.0"
    machine_dir = table_with(**{"following_error_mm = 1.0": tolerant})
    bench = FaultBench(machine_dir, f"jammed_axis:x@{FAULT_TIME_S}", plant=XY_TABLE).run(LAST_CYCLE)
    force = {int(row[1]): abs(row[SHARED + COLUMN["force_command_n"]]) for row in bench.rows}
    saturated = next(cycle for cycle in range(FAULT_CYCLE, LAST_CYCLE) if force[cycle] >= 600.0)
    assert_reaction_in_time(bench, Event.SATURATED, since=saturated)
    assert bench.noted(Event.SATURATED) - saturated < 50  # saturation begins at 98 % of the largest current
    assert bench.emcy() == [0x2310]


@pytest.mark.parametrize(("side", "word"), [(1, "positive"), (-1, "negative")])
def test_limit_switch_that_closes_makes_the_drives_brake(side: int, word: str) -> None:
    bench = FaultBench(XY_TABLE, f"limit_switch:x@{FAULT_TIME_S},side={side}").run(LAST_CYCLE)
    assert_reaction_in_time(bench, Event.LIMIT_SWITCH)
    assert bench.machine.reason == f"axis x: the {word} limit switch has closed"


def test_following_error_makes_the_drives_brake(table_with: Any) -> None:
    machine_dir = table_with(**{"following_error_mm = 1.0": "following_error_mm = 0.3"})
    bench = FaultBench(machine_dir, f"jammed_axis:x@{FAULT_TIME_S}", plant=XY_TABLE).run(LAST_CYCLE)
    error = SHARED + COLUMN["position_error_m"]
    since = next(int(row[1]) for row in bench.rows if abs(row[error]) > 0.3e-3)
    assert_reaction_in_time(bench, Event.FOLLOWING_ERROR, since=since)


def test_position_limit_stops_the_axes_with_a_ramp(table_with: Any) -> None:
    machine_dir = table_with(**{"position_mm = [-100.0, 100.0]": "position_mm = [-10.0, 10.0]"})
    bench = FaultBench(machine_dir, plant=XY_TABLE).run(LAST_CYCLE)
    motor = SHARED + COLUMN["motor_position_m"]
    since = next(int(row[1]) for row in bench.rows if row[motor] > 11e-3)
    assert_reaction_in_time(bench, Event.LIMIT, since=since)


def test_under_voltage_of_one_drive_stops_both() -> None:
    bench = FaultBench(XY_TABLE, f"brownout:y@{FAULT_TIME_S}").run(LAST_CYCLE)
    assert_reaction_in_time(bench, Event.EMCY)
    assert any("EMCY 3220h, DC link under-voltage" in text for text in bench.machine.events.kept)
    assert bench.at_rest(0)
    assert bench.at_rest(1)


# --- enabling again -------------------------------------------------------------------------------------


def with_standby(bench: FaultBench) -> FaultBench:
    """The bench, whose machine goes to standby after a stop."""
    bench.machine.stand_by = bench.machine.served = True
    return bench


def test_axis_is_switched_on_again_after_a_fault_that_has_passed() -> None:
    bench = with_standby(FaultBench(XY_TABLE, f"brownout:y@{FAULT_TIME_S}")).run(1000)
    assert bench.machine.stage is Stage.STANDBY
    assert bench.machine.enable() == ""
    assert bench.run(300).machine.stage in {Stage.READY, Stage.RUNNING}


def test_node_that_was_written_to_is_set_up_again_before_any_drive_gets_power() -> None:
    bench = with_standby(FaultBench(XY_TABLE)).run(FAULT_CYCLE)
    bench.inject(0x601, bytes.fromhex("23 65 60 00 10 27 00 00"))
    bench.run(600)
    assert bench.machine.stage is Stage.STANDBY
    assert bench.machine.nodes is not None
    booted: list[list[int]] = []
    bench.machine.nodes.boot = booted.append
    assert bench.machine.enable() == ""
    assert (booted, bench.machine.setting_up, bench.machine.stage) == ([[0]], True, Stage.STANDBY)


def test_second_node_is_noted_in_standby_too_and_stops_the_next_attempt() -> None:
    bench = with_standby(FaultBench(XY_TABLE)).run(FAULT_CYCLE)
    bench.inject(0x181, bytes(3))
    bench.run(600)
    assert bench.machine.stage is Stage.STANDBY
    assert bench.machine.enable() == ""
    bench.inject(0x181, bytes(3))
    bench.run(300)
    assert bench.machine.stage is Stage.STANDBY
    assert bench.machine.failed
