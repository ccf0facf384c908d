"""How an operator runs a program: overrides, single block, optional stop, from a line, lines of their own."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from ideal_drives import COUNT_M, PERIOD_S, OperatedStand

from servo_ctrl.commands.command import Command, Refusal
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.freeze import motion_limits
from servo_ctrl.config.load import load_program
from servo_ctrl.daemon.set_points.pace import at_raised_feed
from servo_ctrl.errors import ConfigError
from servo_ctrl.motion.circle import Circle
from servo_ctrl.motion.move import Move
from servo_ctrl.motion.path.path_move import Element, Line, PathMove

Operate = Callable[..., OperatedStand]

BRACKET = """G21 G90 G64 P0.05
G0 X0 Y0
G1 X4 F1200
Y3
M1
X0
G0 Y0
M2
"""
LIMIT_M_S2 = 2.0


@pytest.fixture
def loaded(enabled: Operate, tmp_path: Path) -> OperatedStand:
    made = enabled()
    load(made, tmp_path)
    return made


def load(made: OperatedStand, directory: Path, text: str = BRACKET, first_line: int = 1) -> str:
    path = directory / "bracket.ngc"
    path.write_text(text, encoding="utf-8")
    program = load_program(path, made.config, reading=made.handler.reading(first_line))
    reason: str = made.handler.load_program(program).reason
    return reason


def line(made: OperatedStand, directory: Path, text: str) -> str:
    path = directory / "line.ngc"
    path.write_text(text, encoding="utf-8")
    reason: str = made.handler.run_line(
        load_program(path, made.config, reading=made.handler.reading_of_line())
    ).reason
    return reason


def run_out(made: OperatedStand, cycles: int = 20_000) -> int:
    """Run until the machine is ready; how many cycles that took."""
    before = made.cycle
    while made.machine.stage is not Stage.READY or made.cycle == before:
        made.run(1)
        assert made.cycle - before < cycles
    return made.cycle - before


def speed_m_s(commanded_m: np.ndarray) -> np.ndarray:
    return np.hypot(*np.diff(commanded_m, axis=0).T) / PERIOD_S


def test_overrides_slow_the_feed_and_the_rapids_apart_on_the_same_path(loaded: OperatedStand) -> None:
    made = loaded
    made.ask(Command.START_PROGRAM)
    plain, first = run_out(made), len(made.commanded_m())
    assert made.handler.change("feed_override_percent", 50.0).accepted
    made.ask(Command.START_PROGRAM)
    slow, path_m = run_out(made), made.commanded_m()[first:]
    assert made.status.settings.feed_override_percent == 50.0
    assert slow > plain + 450, "11 mm at 20 mm/s take 0.55 s longer"
    # the feed of F1200 is 20 mm/s: half of it, and the rapid move back as ever
    along_x = speed_m_s(path_m[(path_m[:, 1] == 0.0) & (path_m[:, 0] > 0.001)])
    assert np.median(along_x) == pytest.approx(0.010, rel=1e-6)
    rapid = speed_m_s(path_m[(path_m[:, 0] == 0.0) & (path_m[:, 1] > 0.0)])
    assert rapid.max() > 0.03
    assert np.abs(np.diff(path_m, 2, axis=0)).max() <= LIMIT_M_S2 * PERIOD_S**2 * 1.001
    assert path_m[-1] == pytest.approx([0.0, 0.0], abs=1e-12)

    made.handler.change("feed_override_percent", 100.0)
    made.handler.change("rapid_override_percent", 10.0)
    made.ask(Command.START_PROGRAM)
    first = len(made.commanded_m())
    assert run_out(made) > plain
    path_m = made.commanded_m()[first:]
    rapid = speed_m_s(path_m[(path_m[:, 0] == 0.0) & (path_m[:, 1] > 0.0)])
    assert rapid.max() < 0.02, "10 % of at most 200 mm/s"


@pytest.mark.parametrize(
    ("name", "percent"), [("feed", 0.0), ("feed", 151.0), ("feed", float("nan")), ("rapid", 101.0)]
)
def test_overrides_have_bounds(enabled: Operate, name: str, percent: float) -> None:
    made = enabled()
    assert made.handler.change(f"{name}_override_percent", percent).refusal is Refusal.OUT_OF_RANGE
    assert made.status.settings.feed_override_percent == 100.0
    assert made.status.settings.rapid_override_percent == 100.0


def feed_along_x_m_s(path_m: np.ndarray) -> float:
    """The most usual speed on the line G1 X4, off its ends."""
    on_line = (path_m[:, 1] == 0.0) & (path_m[:, 0] > 0.001) & (path_m[:, 0] < 0.0035)
    return float(np.median(speed_m_s(path_m[on_line])))


def test_a_raised_feed_is_planned_at_the_start_within_the_limits(loaded: OperatedStand) -> None:
    made = loaded
    limits = motion_limits(made.config)
    made.ask(Command.START_PROGRAM)
    made.run(20)
    made.handler.change("feed_override_percent", 150.0)  # no plan changes while the axes move on it
    plain, first = run_out(made), len(made.commanded_m())
    assert feed_along_x_m_s(made.commanded_m()) == pytest.approx(0.020, rel=1e-6)
    made.ask(Command.START_PROGRAM)
    assert run_out(made) < plain - 50
    path_m = made.commanded_m()[first:]
    assert feed_along_x_m_s(path_m) == pytest.approx(0.030, rel=1e-6)
    assert np.abs(np.diff(path_m, axis=0)).max() <= limits.velocity_m_s.min() * PERIOD_S * 1.001
    assert np.abs(np.diff(path_m, 2, axis=0)).max() <= limits.acceleration_m_s2.min() * PERIOD_S**2 * 1.001
    assert np.abs(np.diff(path_m, 3, axis=0)).max() <= limits.jerk_m_s3.min() * PERIOD_S**3 * 1.001
    assert path_m[-1] == pytest.approx([0.0, 0.0], abs=1e-12)

    first = len(made.commanded_m())
    made.ask(Command.START_PROGRAM)
    made.run(2)
    made.handler.change("feed_override_percent", 100.0)  # down is at once, on the plan for 150 %
    run_out(made)
    assert feed_along_x_m_s(made.commanded_m()[first:]) == pytest.approx(0.020, rel=1e-6)


def test_what_a_raised_feed_makes_faster() -> None:
    rapid, fed = (Element(Line((0.1, 0.0)), feed, 1, True) for feed in (math.inf, 0.02))
    move, circle = Move("m", (0.1, 0.0), 0.1, math.inf, False), Circle("c", (0, 1), 0.01, 0.1, 1.0, True, 0.1)
    path, faster, beyond, same = at_raised_feed(
        [PathMove("p", (rapid, fed), 0.0), move, move._replace(feed_m_s=0.3), circle], 1.5, 0.12
    )
    assert isinstance(path, PathMove)
    assert [element.feed_m_s for element in path.elements] == [math.inf, pytest.approx(0.03)]
    assert faster == move._replace(feed_m_s=0.12)
    assert beyond == move._replace(feed_m_s=0.3), (
        "the check of the program refuses it, as without an override"
    )
    assert same == circle


def test_an_override_in_motion_is_within_the_limits_and_a_hold_goes_before(loaded: OperatedStand) -> None:
    made = loaded
    made.ask(Command.START_PROGRAM)
    for percent in (30.0, 100.0, 1.0, 60.0, 100.0):
        made.handler.change("feed_override_percent", percent)
        made.handler.change("rapid_override_percent", percent)
        made.run(60)
    made.ask(Command.HOLD_PROGRAM)
    made.run(100)
    assert (made.commanded_m()[-50:] == made.commanded_m()[-1]).all()
    made.ask(Command.RESUME_PROGRAM)
    run_out(made)
    path_m = made.commanded_m()
    assert np.abs(np.diff(path_m, 2, axis=0)).max() <= LIMIT_M_S2 * PERIOD_S**2 * 1.001
    assert path_m[-1] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_single_block_holds_after_every_block_and_the_line_in_motion_is_shown(loaded: OperatedStand) -> None:
    made = loaded
    made.handler.jog_step("x", 0.001)
    run_out(made)
    assert made.handler.change("single_block", True).accepted
    made.ask(Command.START_PROGRAM)
    stood, lines = [], []
    for _ in range(4):
        made.run(400)
        assert made.status.program.held_by == "single block"
        stood.append([round(x * 1e3, 6) for x in made.commanded_m()[-1]])
        made.ask(Command.RESUME_PROGRAM)
        made.run(30)
        lines.append(made.status.program.line)
    assert stood == [[0, 0], [4, 0], [4, 3], [0, 3]]
    assert lines == [3, 4, 6, 7]
    run_out(made)
    assert not made.status.program.held, "nothing is held behind the last block"
    assert made.status.program.line == 0


def test_optional_stop_holds_at_m1_where_it_is_on(loaded: OperatedStand) -> None:
    made = loaded
    made.ask(Command.START_PROGRAM)
    run_out(made)
    made.handler.change("optional_stop", True)
    made.ask(Command.START_PROGRAM)
    made.run(2000)
    assert (made.status.program.held, made.status.program.held_by) == (True, "optional stop, line 5")
    assert made.commanded_m()[-1] == pytest.approx([0.004, 0.003], abs=1e-12)
    made.ask(Command.RESUME_PROGRAM)
    run_out(made)


def test_a_program_is_run_from_a_line_with_what_held_there(loaded: OperatedStand, tmp_path: Path) -> None:
    made = loaded
    made.handler.jog_step("x", -0.002)
    run_out(made)
    assert load(made, tmp_path, first_line=6) == ""
    assert made.status.program.entry == "line 6: G1 G17 G21 G90 G54 G64 P0.05 F1200"
    first = len(made.commanded_m())
    made.ask(Command.START_PROGRAM)
    run_out(made)
    path_m = made.commanded_m()[first:]
    ends = np.flatnonzero((path_m == [0.004, 0.003]).all(axis=1))
    assert len(ends), "it goes first to where the line before ends"
    approach = path_m[: ends[0]]
    assert np.abs(approach[:, 1] - 0.5 * (approach[:, 0] + 0.002)).max() < 1e-9, "straight"
    behind = path_m[ends[0] :]
    assert np.median(speed_m_s(behind[behind[:, 0] > 0.001])) == pytest.approx(0.02, rel=1e-6)
    with pytest.raises(ConfigError, match="line 60: the program ends before, at line 8"):
        load(made, tmp_path, first_line=60)


def test_a_line_of_its_own_goes_on_from_the_one_before_and_leaves_the_program(
    loaded: OperatedStand, tmp_path: Path
) -> None:
    made = loaded
    assert line(made, tmp_path, "G91 G1 X1 F600") == ""
    assert made.machine.stage is Stage.RUNNING
    assert (made.status.program.apart, made.status.program.name) == (True, "bracket.ngc")
    run_out(made)
    assert line(made, tmp_path, "Y2") == "", "G91, G1 and F600 hold"
    run_out(made)
    assert made.positions_m() == pytest.approx([0.001, 0.002], abs=COUNT_M)
    assert made.status.program.modes == "G1 G17 G21 G91 G54 G64 P0.01 F600"
    assert line(made, tmp_path, "G90 G0 X0 Y0") == ""
    assert line(made, tmp_path, "X1") == "the machine is running, not ready"
    run_out(made)
    assert "axis x: position" in line(made, tmp_path, "X500")
    made.ask(Command.START_PROGRAM)
    run_out(made)
    assert made.status.program.apart is False


def test_a_line_read_before_the_axes_moved_is_refused(loaded: OperatedStand, tmp_path: Path) -> None:
    made = loaded
    path = tmp_path / "line.ngc"
    path.write_text("G91 G0 X1", encoding="utf-8")
    read = load_program(path, made.config, reading=made.handler.reading_of_line())
    made.handler.jog_step("x", 0.001)
    run_out(made)
    assert made.handler.run_line(read).reason == "the axes have moved while the line was read; send it again"


def test_a_step_is_exact_bounded_and_within_the_travel(enabled: Operate) -> None:
    made = enabled()
    for way_m in (1e-6, 1e-4, 1e-2, -1e-3):
        start_m = made.machine.set_points_m()[0]
        assert made.handler.jog_step("x", way_m).accepted
        assert made.handler.jog_step("x", way_m).reason == "the axis is on its way; wait for its end"
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
