"""Corrections of the motor set point, each alone: screw table, take-up, sampled dual loop."""

import itertools
import math
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from servo_ctrl.control.compensation import backlash, sampled_dual_loop, screw_error
from servo_ctrl.control.compensation.backlash import advance_take_up
from servo_ctrl.control.compensation.sampled_dual_loop import advance_sampled
from servo_ctrl.control.compensation.screw_error import screw_error_m
from servo_ctrl.control.offset_motion import OffsetMotion, offset_m, over
from servo_ctrl.motion import s_curve

T = 1e-3
REST = OffsetMotion(0.0, 0.0, 0.0, 0.0, True)
TAKE_UP = backlash.Params(True, 8e-6, 0.5, 50.0)
SAMPLED = sampled_dual_loop.Params(True, 0.02, 0.5e-6, 3, 20e-6, True, 0.5, 50.0, 1.0)


@settings(deadline=None)
@given(
    st.integers(1, 9).flatmap(
        lambda n: st.tuples(
            arrays.arrays(np.float64, n, elements=st.floats(-0.2, 0.2), unique=True),
            arrays.arrays(np.float64, n, elements=st.floats(-1e-4, 1e-4)),
        )
    ),
    st.floats(-0.3, 0.3),
)
def test_the_screw_error_equals_numpys_interpolation(
    nodes: tuple[np.ndarray, np.ndarray], position_m: float
) -> None:
    positions, errors = np.sort(nodes[0]), nodes[1]
    p = screw_error.Params(True, np.ascontiguousarray(np.stack((positions, errors))))
    expected = np.interp(position_m, positions, errors)
    assert screw_error_m(p, position_m) == pytest.approx(expected, rel=1e-9, abs=1e-15)
    assert screw_error_m(p._replace(enabled=False), position_m) == 0.0


def taken_up(directions: list[float], p: backlash.Params = TAKE_UP) -> np.ndarray:
    """The take-up at every tick."""
    state, found = REST, []
    for direction in directions:
        state = advance_take_up(p, state, direction, T)
        found.append(offset_m(state))
    return np.array(found)


def test_the_motor_goes_ahead_by_half_the_lost_motion_once_a_direction_is_known() -> None:
    found = taken_up([0.0] * 20 + [1.0] * 60 + [-1.0] * 60)
    assert not found[:20].any()
    assert found[79] == 4e-6
    assert found[139] == -4e-6


def test_a_reversal_is_taken_up_by_the_planners_five_phase_curve() -> None:
    found = taken_up([1.0] * 60 + [-1.0] * 60)[59:]
    plan = s_curve.s_curve(8e-6, 1e9, 0.5, 50.0)
    expected = 4e-6 - plan.travelled(np.minimum(np.arange(len(found)) * T, plan.duration_s))[0]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-15)


@settings(deadline=None, max_examples=40)
@given(st.lists(st.tuples(st.sampled_from([-1.0, 1.0]), st.integers(1, 40)), min_size=1, max_size=8))
def test_whenever_reversals_come_the_take_up_keeps_its_bounds_and_arrives(
    turns: list[tuple[float, int]],
) -> None:
    directions = [direction for direction, ticks in turns for _ in range(ticks)]
    found = np.concatenate(([0.0] * 3, taken_up(directions + directions[-1:] * 80)))
    assert np.abs(found).max() <= 4e-6
    assert found[-1] == 4e-6 * directions[-1]
    assert np.abs(np.diff(found, 2)).max() <= 0.5 * T**2 * (1.0 + 1e-6)
    assert np.abs(np.diff(found, 3)).max() <= 50.0 * T**3 * (1.0 + 1e-6)


def test_disabled_the_correction_is_ramped_out() -> None:
    on = [(1.0, TAKE_UP)] * 60
    off = [(1.0, TAKE_UP._replace(enabled=False))] * 60
    state, found = REST, []
    for direction, p in on + off:
        state = advance_take_up(p, state, direction, T)
        found.append(offset_m(state))
    assert found[59] == 4e-6
    assert found[-1] == 0.0
    assert np.abs(np.diff(found[55:], 2)).max() <= 0.5 * T**2 * (1.0 + 1e-6)


def corrected(
    deviations: Callable[[float], float],
    ticks: int,
    p: sampled_dual_loop.Params = SAMPLED,
    state: sampled_dual_loop.State = sampled_dual_loop.State(0.0, 0, REST),  # noqa: B008  # immutable
    moving: Iterator[bool] = itertools.repeat(False),  # noqa: B008  # for ever
) -> tuple[sampled_dual_loop.State, list[float]]:
    """The correction at every tick, for a deviation that depends on it."""
    found = []
    for _ in range(ticks):
        state = advance_sampled(p, state, deviations(offset_m(state.motion)), next(moving), T)
        found.append(offset_m(state.motion))
    return state, found


def test_nothing_is_corrected_before_the_axis_has_settled_and_the_deviation_is_then() -> None:
    _, found = corrected(lambda c: 4e-6 - c, 200)
    assert not any(found[:20])
    assert found[20] > 0.0
    assert found[-1] == 4e-6


def test_the_scale_is_read_once_after_settling_and_not_in_motion() -> None:
    # what it says in between changes nothing
    rng = np.random.default_rng(4)
    reads = iter(range(1000))
    _, found = corrected(lambda _: 4e-6 if next(reads) == 19 else rng.normal(0.0, 1e-3), 30)
    plan = s_curve.s_curve(4e-6, 1e9, 0.5, 50.0)
    expected = plan.travelled(np.arange(11) * T)[0]
    np.testing.assert_allclose(found[19:], expected, rtol=0.0, atol=1e-15)


@pytest.mark.parametrize(("deviation_m", "corrects"), [(0.5e-6, False), (-0.5e-6, False), (0.51e-6, True)])
def test_a_deviation_within_the_tolerance_is_left(deviation_m: float, corrects: bool) -> None:
    position_m = 0.0731205  # as read from counts: the difference is rounded
    _, found = corrected(lambda c: (position_m + deviation_m) - position_m - c, 300)
    assert any(found) == corrects


def test_the_number_of_corrections_is_bounded_at_each_end_point() -> None:
    state, found = corrected(lambda _: 2e-6, 1000)  # a table that does not answer
    assert found[-1] == pytest.approx(3 * 2e-6)
    assert state.corrections == 3
    state, _ = corrected(lambda _: 2e-6, 1, state=state, moving=iter([True]))
    assert offset_m(state.motion) == pytest.approx(6e-6)  # what was corrected stays in force
    _, found = corrected(lambda _: -2e-6, 1000, state=state)
    assert found[-1] == pytest.approx(0.0, abs=1e-20)


def test_the_corrections_are_bounded() -> None:
    _, found = corrected(lambda _: 1e-3, 1000)
    assert max(found) == 20e-6
    _, found = corrected(lambda _: -1e-3, 1000)
    assert min(found) == -20e-6


def test_a_correction_waits_for_a_missing_scale_reading() -> None:
    reads = iter([math.nan] * 50 + [3e-6] * 500)
    state, found = corrected(lambda _: next(reads), 50)
    assert not any(found)
    assert state.corrections == 0
    _, found = corrected(lambda c: 3e-6 - c, 200, state=state)
    assert found[-1] == 3e-6


def test_motion_restarts_the_settling_time_and_lets_a_correction_finish() -> None:
    state, found = corrected(lambda _: 4e-6, 22)
    assert 0.0 < found[-1] < 4e-6
    state, found = corrected(lambda _: 9e-6, 60, state=state, moving=itertools.repeat(True))
    assert found[-1] == 4e-6
    assert state.rest_s == 0.0
    _, found = corrected(lambda _: 9e-6, 19, state=state)
    assert found == [4e-6] * 19


@pytest.mark.parametrize("smooth", [True, False])
def test_disabled_the_end_point_correction_is_ramped_out(smooth: bool) -> None:
    p = SAMPLED._replace(smooth=smooth)
    state, found = corrected(lambda c: 4e-6 - c, 100, p)
    assert found[-1] == 4e-6
    state, found = corrected(lambda _: 1.0, 100, p._replace(enabled=False), state)
    assert found[-1] == 0.0
    assert np.abs(np.diff([4e-6, 4e-6, *found], 2)).max() <= 0.5 * T**2 * (1.0 + 1e-6)
    assert over(state.motion)


@settings(deadline=None, max_examples=40)
@given(st.floats(0.0, 3e-5), st.floats(-2e-5, 2e-5), st.floats(0.0, 1.0), st.booleans())
def test_an_axis_with_play_comes_within_the_tolerance_and_stays(
    play_m: float, error_m: float, place: float, smooth: bool
) -> None:
    # the motor at c; the table is carried along by one end of the play or the other
    deviation_m = abs(error_m)
    needed = math.ceil(play_m / max(deviation_m, 0.5e-6)) + 2
    p = SAMPLED._replace(corrections=needed, limit_m=1e-3, smooth=smooth)
    state, table_m = sampled_dual_loop.State(0.0, 0, REST), 0.0
    lag_m = play_m * (place - 0.5)  # the table stands somewhere within the play
    for _ in range(needed * 60 + 100):
        state = advance_sampled(p, state, error_m - table_m, False, T)
        motor_m = offset_m(state.motion) + lag_m
        table_m = min(max(table_m, motor_m - 0.5 * play_m), motor_m + 0.5 * play_m)
    assert abs(error_m - table_m) <= 0.5e-6 + 1e-12
    assert over(state.motion)
    assert abs(table_m) <= deviation_m + 1e-12  # and never beyond
