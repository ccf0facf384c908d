"""The force behind a rest: closed form of the table, what counts as a rest, and its bounds."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from servo_ctrl.config.kernel_params import axis_params, with_waveform
from servo_ctrl.config.load import load_machine
from servo_ctrl.control.compensation.learned_waveform import NEUTRAL
from servo_ctrl.control.rest_memory import FOLLOW_M, SPAN_M, Rest, rest_after, rest_force_n, without_rest
from servo_ctrl.motion.move import Dwell, Move
from studies.feng_2015.rival_tuning import force_along
from studies.twin_axis import motion

MACHINE = load_machine(Path(__file__).parents[3] / "machines" / "xy_table")
PARAMS = axis_params(MACHINE, "x")
T = 1e-3
ONWARD, TURNED = (4.0, 6.0, 2.0, 0.0), (1.0, 2.0, 3.0, 0.0)
TABLE = np.array([(0.3, *ONWARD, *TURNED), (30.0, *(2.0 * np.array(ONWARD)), *(3.0 * np.array(TURNED)))])


def travel_m(place: float) -> float:
    """The travel at a place between the forces of a row, from 0."""
    return float(SPAN_M * (place / len(ONWARD)) ** 3)


def after(rest: Rest, steps_m: list[float], direction: float = 1.0) -> Rest:
    for step_m in steps_m:
        rest = rest_after(TABLE, rest, step_m, direction, T)
        direction = math.copysign(1.0, step_m) if step_m else direction
    return rest


def stood(seconds: float) -> Rest:
    return without_rest()._replace(still_s=seconds)


@pytest.mark.parametrize(("turned", "forces_n", "growth"), [(False, ONWARD, 2.0), (True, TURNED, 3.0)])
def test_the_force_is_that_of_the_rest_and_the_way(
    *, turned: bool, forces_n: tuple[float, ...], growth: float
) -> None:
    for node, force_n in enumerate(forces_n[:-1], 1):
        at_m = travel_m(node)
        assert rest_force_n(TABLE, 0.3, turned, at_m) == pytest.approx(force_n)
        assert rest_force_n(TABLE, 30.0, turned, at_m) == pytest.approx(growth * force_n)
        assert rest_force_n(TABLE, 3.0, turned, at_m) == pytest.approx(0.5 * (1.0 + growth) * force_n)
        assert rest_force_n(TABLE, 1e4, turned, at_m) == pytest.approx(growth * force_n)  # held above
        assert rest_force_n(TABLE, 0.03, turned, at_m) == pytest.approx(0.1 * force_n)  # fades below
    between = 0.5 * (forces_n[0] + forces_n[1])
    assert rest_force_n(TABLE, 0.3, turned, travel_m(1.5)) == pytest.approx(between)
    assert rest_force_n(TABLE, 0.3, turned, 0.0) == 0.0
    assert rest_force_n(TABLE, 0.3, turned, SPAN_M) == 0.0


def test_a_rest_begins_where_the_command_stops_and_acts_into_the_new_direction() -> None:
    rest = after(without_rest(), [0.0] * 300)
    assert (rest.still_s, rest.force_n) == (pytest.approx(0.3), 0.0)
    for step_m, turned in ((1e-5, False), (-1e-5, True)):
        moved = after(rest, [step_m])
        assert (moved.stood_s, moved.turned, moved.still_s) == (rest.still_s, turned, 0.0)
        expected_n = math.copysign(rest_force_n(TABLE, 0.3, turned, 1e-5), step_m)
        assert moved.force_n == pytest.approx(expected_n)
    assert after(rest, [1e-5] * 102).force_n == 0.0  # the travel is passed


def test_a_stop_for_some_cycles_does_not_undo_a_long_rest() -> None:
    moved = after(stood(30.0), [1e-5])
    paused = after(moved, [0.0] * 5)
    assert paused.force_n == moved.force_n  # held
    assert after(paused, [1e-5]).stood_s == 30.0
    assert after(moved, [0.0] * 400 + [1e-5]).stood_s == pytest.approx(0.4)  # a rest of its own
    assert after(moved, [1e-5] * 100 + [0.0] * 5 + [1e-5]).stood_s == pytest.approx(0.005)


def test_the_force_does_not_jump_where_a_motion_turns_or_goes_on() -> None:
    step_m = 1e-9
    rest = after(stood(30.0), [step_m] * 2000)
    turned = after(rest, [-step_m])
    assert abs(turned.force_n - rest.force_n) < 2.1 * rest.force_n * step_m / FOLLOW_M
    later = after(rest, [0.0] * 1000 + [step_m])
    assert abs(later.force_n - rest.force_n) < 2.1 * rest.force_n * step_m / FOLLOW_M
    there_and_back = after(rest, [-step_m] * 2000)
    assert there_and_back.force_n == pytest.approx(-rest_force_n(TABLE, 30.0, False, 4e-6), rel=0.05)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(st.floats(-1e-3, 1e-3), st.integers(0, 3), st.floats(0.0, 1e3)), max_size=30))
def test_the_force_is_never_larger_than_the_learned(legs: list[tuple[float, int, float]]) -> None:
    rest, direction = without_rest(), 0.0
    for step_m, stops, long_s in legs:
        rest = after(rest, [0.0] * stops, direction)
        if stops:
            rest = rest._replace(still_s=rest.still_s + long_s)
        rest = after(rest, [step_m], direction)
        direction = math.copysign(1.0, step_m)
        assert abs(rest.force_n) <= TABLE[:, 1:].max()


def moves() -> np.ndarray:
    """Moves of x on and back, with rests."""
    steps: list[Move | Dwell] = []
    for to_m in (0.002, 0.004, 0.001, 0.0012):
        steps += [Move("move", (to_m, math.nan), 0.03, 0.5, trapezoidal=False), Dwell("rest", 0.5)]
    return motion(MACHINE, "x", steps)


def test_a_table_without_force_or_none_changes_no_bit() -> None:
    wave = np.array([(0.1, *np.full(480, 2.0))])
    friction, commands = (3.0, 2.0, 1.0, 0.5, -200.0, 2.0, 0.1), moves()
    plain_n = force_along(with_waveform(PARAMS, friction, wave), commands)
    for table in (NEUTRAL.rests, 0.0 * TABLE + [[0.3] + [0.0] * 8, [30.0] + [0.0] * 8]):
        np.testing.assert_array_equal(
            force_along(with_waveform(PARAMS, friction, wave, table), commands), plain_n
        )
    assert np.abs(force_along(with_waveform(PARAMS, friction, wave, TABLE), commands) - plain_n).max() > 1.0


def test_the_force_behind_a_rest_is_within_the_limit() -> None:
    params = with_waveform(PARAMS, (0.0,) * 7, None, 1e3 * TABLE)
    params = params._replace(waveform=params.waveform._replace(limit_n=5.0))
    force_n = force_along(params, moves())
    assert np.abs(force_n).max() == 5.0
