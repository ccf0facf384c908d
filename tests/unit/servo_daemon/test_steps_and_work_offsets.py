"""Steps of one axis, and work offsets: touched off, kept, and what they hold for."""

from pathlib import Path

import numpy as np
import pytest
from ideal_drives import COUNT_M, PERIOD_S, Operate
from operated_programs import LIMIT_M_S2, line, load, run_out

from servo_ctrl.commands.command import Command, Refusal
from servo_ctrl.errors import ConfigError


def test_a_step_is_exact_bounded_and_within_the_travel(enabled: Operate) -> None:
    made = enabled()
    for way_m in (1e-6, 1e-4, 1e-2, -1e-3):
        start_m = made.machine.set_points_m()[0]
        assert made.handler.jog_step("x", way_m).accepted
        assert made.handler.jog_step("x", way_m).reason == "the axis is moving; wait until it has stopped"
        run_out(made)
        assert made.machine.set_points_m()[0] - start_m == pytest.approx(way_m, abs=1e-15)
    steps = np.diff(made.commanded_m(), axis=0)
    assert np.abs(steps).max() <= 0.010 * PERIOD_S * 1.001
    assert np.abs(np.diff(made.commanded_m(), 2, axis=0)).max() <= LIMIT_M_S2 * PERIOD_S**2 * 1.001
    for way_m in (0.0, 0.0101, float("nan")):
        assert made.handler.jog_step("x", way_m).refusal is Refusal.OUT_OF_RANGE
    assert made.handler.jog_step("z", 0.001).refusal is Refusal.UNKNOWN
    for _ in range(9):
        made.handler.jog_step("y", 0.01)
        run_out(made)
    made.handler.jog_step("y", 0.01)
    run_out(made)
    assert made.handler.jog_step("y", 0.001).reason == "the step leaves the travel"
    assert made.machine.set_points_m()[1] == pytest.approx(0.1, abs=1e-12)


def test_a_step_by_command_takes_the_step_that_is_set_and_a_jog_goes_before_it(enabled: Operate) -> None:
    made = enabled()
    made.handler.change("step_m", 0.002)
    assert made.ask(Command.STEP_FORWARD).reason == "a step needs its axis: x, y"
    assert made.ask(Command.STEP_FORWARD, "y").accepted
    run_out(made)
    assert made.ask(Command.STEP_BACKWARD, "x").accepted
    run_out(made)
    assert made.positions_m() == pytest.approx([-0.002, 0.002], abs=COUNT_M)
    made.ask(Command.STEP_FORWARD, "x")
    made.run(50)
    made.handler.jog("x", 0.0)
    run_out(made)
    assert made.positions_m()[0] < -0.001, "stopped on its way"


def test_work_offsets_are_touched_off_kept_and_hold_for_programs_and_lines(
    enabled: Operate, tmp_path: Path
) -> None:
    made = enabled()
    made.handler.jog_step("x", 0.005)
    run_out(made)
    assert load(made, tmp_path) == ""
    made.handler.change("work_offset", "G55")
    assert made.handler.touch_off("x", 0.001).accepted, "here is X1"
    assert made.ask(Command.START_PROGRAM).reason == (
        "the work offsets have changed since it was read; load it again"
    )
    offsets = {offset.name: offset.zero_m for offset in made.status.program.offsets_m}
    assert offsets["G55"] == pytest.approx((0.004, 0.0))
    assert load(made, tmp_path, "G55 G0 X0 Y0\nG1 X2 F1200\nM2\n") == ""
    made.ask(Command.START_PROGRAM)
    run_out(made)
    assert made.positions_m() == pytest.approx([0.006, 0.0], abs=COUNT_M)
    assert line(made, tmp_path, "G0 X0") == "", "in the offset that is chosen"
    run_out(made)
    assert made.positions_m()[0] == pytest.approx(0.004, abs=COUNT_M)
    with pytest.raises(ConfigError, match="G56 was never set"):
        load(made, tmp_path, "G56 G0 X0 Y0\nM2\n")
    assert made.ask(Command.CLEAR_OFFSET, "x").accepted
    assert made.handler.touch_off("x", 0.9).refusal is Refusal.OUT_OF_RANGE


def test_work_offsets_outlive_the_run_and_a_damaged_file_moves_nothing(
    operated: Operate, enabled: Operate, tmp_path: Path
) -> None:
    made = enabled()
    made.handler.touch_off("y", 0.002)
    (path,) = tmp_path.rglob("work_offsets.toml")
    again = operated().run(5)
    assert again.status.program.offsets_m[0].zero_m == pytest.approx((0.0, -0.002))
    path.write_text("format = 1\n[offset_mm.G54]\nx = 1e9\n", encoding="utf-8")
    doubtful = operated().run(100)
    doubtful.ask(Command.ENABLE)
    doubtful.run(100)
    with pytest.raises(ConfigError, match="the work offsets are unknown, clear them first"):
        load(doubtful, tmp_path)
    assert doubtful.ask(Command.CLEAR_OFFSET).accepted
    assert load(doubtful, tmp_path) == ""
