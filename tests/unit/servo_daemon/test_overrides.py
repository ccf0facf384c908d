"""Overrides of an operator: slower on the same path, faster by a new plan, within bounds."""

import math

import numpy as np
import pytest
from ideal_drives import PERIOD_S, Operate, OperatedStand
from operated_programs import LIMIT_M_S2, run_out, speed_m_s

from servo_ctrl.commands.command import Command, Refusal
from servo_ctrl.config.kernel_params import motion_limits
from servo_ctrl.daemon.set_points.pace import at_raised_feed
from servo_ctrl.motion.circle import Circle
from servo_ctrl.motion.move import Move
from servo_ctrl.motion.path.path_move import Element, Line, PathMove


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
