"""Screw error, take-up and sampled dual loop in the tick: where they act; the motor never jumps."""

import itertools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from compensation_off import NO_FUZZY, NO_LEADING, NO_NOTCH, NO_OBSERVER, NO_PULSE, NO_WAVEFORM, p_loop

from servo_ctrl.control import velocity_loop
from servo_ctrl.control.compensation import backlash, feedforward, sampled_dual_loop, screw_error
from servo_ctrl.control.limits import AxisLimits
from servo_ctrl.control.tick import AxisParams, AxisState, axis_tick, initial_state
from servo_ctrl.control.types import AxisSample, Output, Status

T = 1e-3
ACCELERATION, JERK = 0.5, 50.0
SCREW = screw_error.Params(True, np.array([[-0.01, 0.0, 0.01], [-6e-6, 0.0, 9e-6]]))
TAKE_UP = backlash.Params(True, 8e-6, ACCELERATION, JERK)
SAMPLED = sampled_dual_loop.Params(True, 0.02, 0.5e-6, 3, 20e-6, True, ACCELERATION, JERK, 1.0)
OFF_SCREW, OFF_TAKE_UP, OFF_SAMPLED = NO_LEADING


def params(
    output: Output,
    *,
    scale: bool = False,
    screw: screw_error.Params = SCREW,
    take_up: backlash.Params = TAKE_UP,
    sampled: sampled_dual_loop.Params = OFF_SAMPLED,
) -> AxisParams:
    return AxisParams(
        T,
        int(output),
        p_loop(50.0, scale),
        NO_FUZZY,
        velocity_loop.Params(0.0, 0.0, 1, 1.0),
        NO_NOTCH,
        feedforward.Params(0.0, 0.0),
        NO_PULSE,
        NO_OBSERVER,
        NO_WAVEFORM,
        screw,
        take_up,
        sampled,
        AxisLimits(1e9, 1e9, 1e-3),
    )


class Run(NamedTuple):
    """What came of a course of commands."""

    correction_m: np.ndarray
    error_m: np.ndarray
    velocity_m_s: np.ndarray
    state: AxisState


def run(
    p: AxisParams | Callable[[int], AxisParams],
    commands: list[float],
    *,
    at_m: float = 0.0,
    scale_m: Callable[[float], float] = lambda _motor_m: math.nan,
    bad: tuple[int, ...] = (),
) -> Run:
    """A motor that stands where it was led to a period ago; `bad` ticks have no motor position."""
    state, motor_m = initial_state(at_m), at_m
    rows = []
    for k, command_m in enumerate(commands):
        seen_m = math.nan if k in bad else motor_m
        sample = AxisSample(command_m, 0.0, 0.0, 0.0, seen_m, scale_m(motor_m), math.nan)
        state, command = axis_tick(p(k) if callable(p) else p, state, sample)
        rows.append((command.correction_m, command.position_error_m, command.velocity_m_s))
        motor_m = command.position_m + command.correction_m
    correction_m, error_m, velocity_m_s = np.array(rows).T
    return Run(correction_m, error_m, velocity_m_s, state)


def moves(*places_m: float) -> list[float]:
    """From place to place at 10 mm/s with rests of 0.1 s."""
    course = [np.full(100, places_m[0])]
    for start_m, end_m in itertools.pairwise(places_m):
        course.append(np.linspace(start_m, end_m, 2 + round(abs(end_m - start_m) / 1e-5)))
        course.append(np.full(100, end_m))
    return [float(x) for x in np.concatenate(course)]


def assert_no_jump(led_m: np.ndarray, command_m: np.ndarray | float = 0.0) -> None:
    """The second difference is that of two motions at a time at most, beside that of the command."""
    shaken = np.abs(np.diff(np.concatenate(([0.0, 0.0], led_m)), 2))
    allowed = 2.0 * ACCELERATION * T**2 + 1e-3 * np.abs(np.diff(np.atleast_1d(command_m), 1)).max(initial=0.0)
    assert shaken.max() <= allowed * (1.0 + 1e-6)


@pytest.mark.parametrize("output", [Output.POSITION, Output.VELOCITY])
def test_the_motor_follows_the_command_less_the_screw_error_and_takes_up_the_backlash(output: Output) -> None:
    found = run(params(output), moves(0.0, 5e-3, -5e-3))
    rest_up, rest_down = 100 + 502 + 99, -1
    assert found.correction_m[99] == 0.0
    assert found.correction_m[rest_up] == pytest.approx(-4.5e-6 + 4e-6)
    assert found.correction_m[rest_down] == pytest.approx(3e-6 - 4e-6)
    # the error is that to where the motor is led: a period of the motion, and none at rest
    assert np.abs(found.error_m[[rest_up, rest_down]]).max() < 1e-15
    assert np.abs(found.error_m).max() < 1.1e-5


def test_a_loop_on_the_motor_answers_a_correction_and_one_on_the_scale_does_not() -> None:
    course = [0.0] * 5 + [1e-5] * 5
    on_motor = run(params(Output.VELOCITY), course, scale_m=lambda _: 0.0)
    without = run(
        params(Output.VELOCITY, screw=OFF_SCREW, take_up=OFF_TAKE_UP), course, scale_m=lambda _: 0.0
    )
    assert (on_motor.velocity_m_s != without.velocity_m_s).any()
    on_scale = run(params(Output.VELOCITY, scale=True), course, scale_m=lambda _: 0.0)
    np.testing.assert_array_equal(on_scale.error_m, course)
    np.testing.assert_array_equal(on_scale.velocity_m_s, 50.0 * np.array(course))


@pytest.mark.parametrize("at_m", [-7e-3, 5e-3, 0.02])
def test_activated_away_from_home_the_motor_stays_and_the_screw_correction_is_ramped_in(at_m: float) -> None:
    found = run(params(Output.POSITION), [at_m] * 150, at_m=at_m)
    assert abs(found.correction_m[0]) < 1e-8
    assert_no_jump(found.correction_m)
    assert found.correction_m[-1] == pytest.approx(-np.interp(at_m, *SCREW.table))


@pytest.mark.parametrize("bad", [(), (350,), tuple(range(340, 360))], ids=["seen", "one", "many"])
@pytest.mark.parametrize("motion", [False, True], ids=["resting", "moving"])
@pytest.mark.parametrize(
    "other",
    [
        {"screw": OFF_SCREW, "take_up": TAKE_UP._replace(enabled=False), "sampled": OFF_SAMPLED},
        {
            "screw": screw_error.Params(True, np.array([[0.0], [-7e-6]])),
            "take_up": TAKE_UP._replace(lost_motion_m=2e-6),
        },
    ],
    ids=["none", "another"],
)
def test_changing_tables_in_motion_never_makes_the_motor_jump(
    other: dict[str, object], motion: bool, bad: tuple[int, ...]
) -> None:
    before = params(Output.POSITION, sampled=SAMPLED)
    course = moves(0.0, 5e-3)[:330] if motion else moves(0.0, 1e-3)
    ramp = [course[-1] + (1e-5 * (k + 1) if motion else 0.0) for k in range(400)]
    commands = course + ramp
    found = run(
        lambda k: before if k < 350 else before._replace(**other),
        commands,
        scale_m=lambda motor_m: motor_m - 3e-6,
        bad=bad,
    )
    assert abs(found.correction_m[349]) > 1e-6
    assert_no_jump(found.correction_m, np.array(commands))
    after = before._replace(**other)
    end = -np.interp(commands[-1], *after.screw.table) if after.screw.enabled else 0.0
    end += 0.5 * after.take_up.lost_motion_m if after.take_up.enabled else 0.0
    if not after.sampled.enabled:
        assert found.correction_m[-1] == pytest.approx(end, abs=1e-15)


def test_without_inputs_the_corrections_stand_and_the_screw_error_goes_with_the_command() -> None:
    commands = moves(0.0, 5e-3)
    bad = tuple(range(140, 150))
    whole, found = (run(params(Output.POSITION), commands, bad=gone) for gone in ((), bad))
    np.testing.assert_allclose(found.correction_m[:140], whole.correction_m[:140], rtol=0.0, atol=0.0)
    np.testing.assert_allclose(found.correction_m[150:], whole.correction_m[150:], rtol=0.0, atol=1e-15)
    held = np.array(commands)[140:150]
    np.testing.assert_allclose(found.correction_m[140:150], 4e-6 - 9e-4 * held, rtol=1e-9)


def test_a_non_finite_command_keeps_the_last_motor_set_point() -> None:
    p, state = params(Output.POSITION), run(params(Output.POSITION), moves(0.0, 5e-3)).state
    sample = AxisSample(5e-3, 0.0, 0.0, 0.0, 4.9e-3, math.nan, math.nan)
    _, before = axis_tick(p, state, sample)
    _, command = axis_tick(p, state, sample._replace(position_command_m=math.nan))
    assert Status(command.status) == Status.BAD_COMMAND
    assert (command.position_m, command.correction_m) == (before.position_m, before.correction_m)


@pytest.mark.parametrize("lost_motion_m", [0.0, 3e-6, 15e-6])
def test_the_sampled_dual_loop_brings_the_table_to_its_place_from_both_sides(lost_motion_m: float) -> None:
    # a table with play, and a screw that is 1 um a millimetre short; the scale counts half micrometres
    table_m: list[float] = [0.0]

    def scale_m(motor_m: float) -> float:
        led_m = 0.999 * motor_m
        table_m.append(min(max(table_m[-1], led_m - 0.5 * lost_motion_m), led_m + 0.5 * lost_motion_m))
        return round(table_m[-1] / 0.5e-6) * 0.5e-6

    p = params(Output.POSITION, screw=OFF_SCREW, take_up=OFF_TAKE_UP, sampled=SAMPLED._replace(corrections=9))
    places_m = (0.0, 4e-3, 2e-3, 6e-3)
    course = [np.r_[np.linspace(a, b, 400), np.full(900, b)] for a, b in itertools.pairwise(places_m)]
    found = run(p, np.concatenate(course).tolist(), scale_m=scale_m)
    for k, place_m in enumerate(places_m[1:], 1):
        assert abs(place_m - table_m[1300 * k]) <= 0.75e-6
        assert np.ptp(found.correction_m[1300 * k - 300 : 1300 * k]) == 0.0


def test_the_sampled_dual_loop_waits_until_the_play_has_been_taken_up() -> None:
    slow = TAKE_UP._replace(acceleration_m_s2=1e-3)
    p = params(Output.POSITION, screw=OFF_SCREW, take_up=slow, sampled=SAMPLED)
    found = run(p, [0.0, 1e-6, *[1e-6] * 400], scale_m=lambda _: 0.0)
    arrived = int(np.flatnonzero(found.correction_m >= 4e-6)[0])
    assert arrived > 100  # longer than the time it settles
    later = int(np.flatnonzero(found.correction_m > 4e-6)[0])
    assert later - arrived >= 19


def test_a_sampled_loop_with_a_small_gain_takes_its_share_once_an_end_point() -> None:
    offset_m, gain = 8e-6, 0.25
    sampled = SAMPLED._replace(corrections=1, gain=gain)
    p = params(Output.POSITION, screw=OFF_SCREW, take_up=OFF_TAKE_UP, sampled=sampled)
    course = moves(0.0, 1e-3, 2e-3, 3e-3)
    found = run(p, course, scale_m=lambda motor_m: motor_m - offset_m)
    ends = [k for k in range(len(course) - 1) if course[k] == course[k - 1] != course[k + 1]]
    for number, end in enumerate([*ends, len(course) - 1], 1):
        assert found.correction_m[end] == pytest.approx(offset_m * (1.0 - (1.0 - gain) ** number))
