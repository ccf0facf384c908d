"""The learned force in the tick: its parts against closed forms, its forecast, its bounds."""

import math
from pathlib import Path

import numpy as np
import pytest
from waveform_examples import example_waveform

from servo_ctrl.config.kernel_params import axis_params, with_observer, with_waveform
from servo_ctrl.config.learning import waveform_settings
from servo_ctrl.config.load import load_machine
from servo_ctrl.control.compensation import trapezoidal_pulse
from servo_ctrl.control.compensation.learned_waveform import (
    NEUTRAL,
    SPRING_BACK_M,
    State,
    at_rest,
    planned_force,
    powered_again,
)
from servo_ctrl.control.presliding_memory import Branch, Turn, relaxed_at, turned
from servo_ctrl.control.rest_memory import Rest, without_rest
from servo_ctrl.control.reversal_forecast import forecast
from servo_ctrl.control.tick import AxisParams, axis_tick, initial_state
from servo_ctrl.control.types import AxisSample
from servo_ctrl.control.waveform_table import AHEAD_S, wave_n
from servo_ctrl.learning.performance import reversals
from servo_ctrl.learning.reversal_waveform import presliding_states, wave_table
from studies.feng_2015.rival_tuning import force_along

MACHINE = load_machine(Path(__file__).parents[3] / "machines" / "xy_table")
T = 1e-3
PARAMS = axis_params(MACHINE, "x")


def sine(radius_m: float = 0.01, speed_rad_s: float = 2.0, samples: int = 6000) -> np.ndarray:
    angle = speed_rad_s * np.arange(samples) * T
    motion = (np.sin(angle), speed_rad_s * np.cos(angle), -(speed_rad_s**2) * np.sin(angle), 0.0 * angle)
    return radius_m * np.column_stack(motion)


def with_example(limit_n: float = 1e3) -> AxisParams:
    learned = example_waveform()
    table = wave_table(learned.accelerations_m_s2, learned.waves_n)
    made = with_waveform(PARAMS, learned.friction, table)
    return made._replace(waveform=made.waveform._replace(limit_n=limit_n))


def test_friction_is_the_memory_of_the_command_at_the_lead() -> None:
    friction = (3.0, 2.0, 1.0, 0.5, -200.0, 2.0, 0.1)
    commands = sine()
    lead = round(PARAMS.waveform.lead_s / T)
    memory = presliding_states(waveform_settings(MACHINE, "x").loop, commands[:, 0]) @ np.array(friction[:4])
    motion = np.column_stack([commands[:, 1:3], np.diff(commands[:, 2], prepend=0.0) / T])
    expected_n = memory[lead:] + motion[:-lead] @ np.array(friction[4:])
    found_n = force_along(with_waveform(PARAMS, friction), commands)
    assert found_n[10:-lead] == pytest.approx(expected_n[10:], abs=0.02)


def test_the_waveform_begins_before_the_reversal_and_turns_with_it() -> None:
    level_n = 2.0
    table = wave_table((0.04,), (tuple(np.full(480, level_n).tolist()),))
    commands = sine()
    force_n = force_along(with_waveform(PARAMS, (0.0,) * 7, table), commands)
    first, second = reversals(commands[:, 0])[:2]
    ahead = round(AHEAD_S / T)
    begins = np.flatnonzero(force_n[:first] == 0.0)[-1] + 1
    assert abs(begins - (first - ahead)) <= 1
    assert force_n[first] == pytest.approx(-level_n, rel=1e-4)  # into the negative direction
    assert force_n[second] == pytest.approx(level_n, rel=1e-4)


def test_a_waveform_covers_the_same_distance_at_each_acceleration() -> None:
    falling = tuple(np.concatenate([np.zeros(31), np.linspace(1.0, 0.0, 101), np.zeros(10)]).tolist())
    alone, no_lead = wave_table((0.01,), (falling,)), 0.0
    assert wave_n(alone, 0.052, 0.01, no_lead, T) == pytest.approx(0.5)
    assert wave_n(alone, 0.026, 0.04, no_lead, T) == pytest.approx(0.5)  # held above, over its distance
    assert wave_n(alone, 0.052, 0.0025, no_lead, T) == pytest.approx(0.25 * 0.76)  # fades below
    both = wave_table((0.01, 0.04), (falling, falling))
    times = [52.0 * math.sqrt(0.02 / a) - 2.0 for a in (0.01, 0.04)]
    expected = np.mean([1.0 - time / 100.0 for time in times])
    assert wave_n(both, 0.052, 0.02, no_lead, T) == pytest.approx(expected)
    assert wave_n(NEUTRAL.waves, 0.05, 0.02, no_lead, T) == 0.0


def start_from_rest(jerk: float, speed_rad_s: float = 2.0) -> np.ndarray:
    """A rest after a motion, and 300 samples of an S curve into the other direction."""
    there = sine(speed_rad_s=speed_rad_s, samples=round(0.5 * math.pi / speed_rad_s / T))
    rest = np.tile([there[-1, 0], 0.0, 0.0, 0.0], (200, 1))
    time_s = np.arange(1, 301) * T
    back = np.column_stack(
        [there[-1, 0] - jerk * time_s**3 / 6.0, -jerk * time_s**2 / 2.0, -jerk * time_s, 0.0 * time_s]
    )
    return np.concatenate([there, rest, back])


def test_the_distance_counts_where_the_acceleration_grows_after_the_reversal() -> None:
    """A start from rest into the other direction by an S curve: the learned a t^2 / 2, wherever it is."""
    level = tuple(np.concatenate([np.zeros(60), np.ones(100), np.zeros(200)]).tolist())
    table, jerk = wave_table((0.1,), (level,)), 10.0
    force_n = force_along(with_waveform(PARAMS, (0.0,) * 7, table), start_from_rest(jerk))[-300:]
    time_s = np.arange(1, 301) * T
    acting_s = time_s[force_n < -0.5]
    lead_s = PARAMS.waveform.lead_s
    for edge_s, column in ((acting_s[0], 60), (acting_s[-1], 160)):
        way_m = jerk * (edge_s + lead_s) ** 3 / 6.0
        row_s = (column + 1) * T - AHEAD_S + lead_s
        assert way_m == pytest.approx(0.05 * row_s**2, rel=0.06)


def test_the_speed_at_the_place_selects_the_row() -> None:
    """Behind x = j t^3 / 6 the motion of constant acceleration of the same place and speed: v^2 / (2 x)."""
    jerk, lead_s = 10.0, PARAMS.waveform.lead_s
    accelerations = (0.1, 0.2, 0.4, 0.8)
    levels = tuple(tuple(np.full(480, np.log2(a / 0.05)).tolist()) for a in accelerations)
    params = with_waveform(PARAMS, (0.0,) * 7, wave_table(accelerations, levels))
    force_n = force_along(params, start_from_rest(jerk))[-300:]
    for sample in (20, 40, 80):
        since_s = (sample + 1) * T + lead_s
        expected_n = np.log2(0.75 * jerk * since_s / 0.05)  # v = j t^2 / 2
        assert -force_n[sample] == pytest.approx(expected_n, abs=1e-3)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_the_forecast_is_that_of_constant_jerk(direction: float) -> None:
    velocity, acceleration, jerk = 4e-3, -0.1, -5.0
    left_s, reverse_m_s2 = forecast(1.0, velocity, acceleration, jerk)
    assert velocity + acceleration * left_s + 0.5 * jerk * left_s**2 == pytest.approx(0.0, abs=1e-12)
    assert reverse_m_s2 == pytest.approx(-(acceleration + jerk * left_s))
    again = forecast(direction, direction * velocity, direction * acceleration, direction * jerk)
    assert again == (left_s, reverse_m_s2)


@pytest.mark.parametrize(
    ("velocity", "acceleration", "jerk"),
    [(1e-2, 0.1, 0.0), (1e-2, 0.0, 0.0), (0.0, 0.0, 0.0), (1e-2, -0.1, 1.0)],
    ids=["faster", "even", "rest", "an S curve that only slows down"],
)
def test_no_reversal_is_foreseen_where_none_comes(velocity: float, acceleration: float, jerk: float) -> None:
    left_s, _ = forecast(1.0, velocity, acceleration, jerk)
    assert not left_s <= AHEAD_S


def test_the_force_is_bounded_whatever_was_learned() -> None:
    force_n = force_along(with_example(limit_n=1.5), sine())
    commands = sine()
    motion = np.column_stack([commands[:, 1:3], np.diff(commands[:, 2], prepend=0.0) / T])
    motion_n = motion @ np.array([-200.0, 2.0, 0.1])
    assert np.abs(force_n - np.clip(motion_n, -1.5, 1.5)).max() == pytest.approx(1.5)


def ticks(params: AxisParams, commands: np.ndarray, bad: slice = slice(0)) -> np.ndarray:
    """Force commands of an axis that follows without error."""
    state, force_n = initial_state(0.0), []
    for k, (x, v, a, offset) in enumerate(commands.tolist()):
        motor = math.nan if k in range(*bad.indices(len(commands))) else x
        state, command = axis_tick(params, state, AxisSample(x, v, a, offset, motor, x, 0.0))
        force_n.append(command.force_n)
    return np.array(force_n)


def test_the_tick_adds_it_instead_of_pulse_and_observer() -> None:
    commands = sine(samples=2000)
    without_n = ticks(PARAMS, commands)
    learned = with_example()
    with_it_n = ticks(with_observer(learned, enabled=True), commands)
    assert with_it_n - without_n == pytest.approx(force_along(learned, commands), abs=1e-6)
    assert np.abs(with_it_n).max() <= PARAMS.limits.force_n
    narrow = learned._replace(limits=learned.limits._replace(force_n=2.0))
    assert np.abs(ticks(narrow, commands)).max() == 2.0


def test_cycles_without_inputs_leave_the_force_where_it_would_be() -> None:
    commands = sine(samples=2000)
    reversal = int(reversals(commands[:, 0])[0])
    whole_n = force_along(with_example(), commands)
    without_n = ticks(PARAMS, commands, slice(reversal - 5, reversal + 5))
    found_n = ticks(with_example(), commands, slice(reversal - 5, reversal + 5)) - without_n
    assert found_n[reversal + 50 :] == pytest.approx(whole_n[reversal + 50 :], abs=0.3)


def test_a_short_motion_before_the_reversal_shortens_the_waveform() -> None:
    """Behind 40 um from rest, a row of 100 um, learned at full sliding, ends after 40 + 100 / 2 um."""
    row_m = 100e-6
    ends = round((AHEAD_S + math.sqrt(2.0 * row_m / 0.1)) / T)
    level = tuple(np.where(np.arange(480) < ends, 1.0, 0.0).tolist())
    params = with_waveform(PARAMS, (0.0,) * 7, wave_table((0.1,), (level,)))
    for turn_m, expected_m in ((40e-6, 90e-6), (5e-3, row_m)):
        there, back = round(math.sqrt(turn_m / 0.05) / T), round(math.sqrt(1e-3 / 0.05) / T)
        time_s = np.arange(-there, back) * T
        position_m = turn_m - 0.05 * time_s**2
        commands = np.column_stack([position_m, -0.1 * time_s, np.full(len(time_s), -0.1), 0.0 * time_s])
        commands -= [commands[0, 0], 0.0, 0.0, 0.0]
        force_n = force_along(params, commands)[there + 1 :]
        passed_m = commands[there, 0] - commands[there + 1 :, 0]
        assert passed_m[force_n < -0.5][-1] == pytest.approx(expected_m, rel=0.1)


BEFORE = State(
    lead_position_m=0.02,
    acceleration_m_s2=0.0,
    direction=1.0,
    branch=relaxed_at(0.0),
    memory_1=1.0,
    memory_2=1.0,
    memory_3=1.0,
    memory_4=0.9,
    rest=Rest(still_s=3.0, stood_s=0.2, turned=True, travel_m=2e-4, force_n=1.5),
)


def positions(branch: Branch) -> list[float]:
    """Positions of a memory; it holds no force."""
    assert not any(turn.held_n for turn in branch[1:])
    return [branch.rest_m, *(turn.position_m for turn in branch[1:])]


def test_friction_that_springs_back_without_power_is_a_reversal_in_the_memory() -> None:
    """The motor's encoder is 3 um from the command, and reads 8 um less than when power went."""
    found = powered_again(BEFORE, -8e-6, 0.019989)
    assert found == State(0.019989, 0.0, -1.0, found.branch, 0.0, 0.0, 0.0, 0.0, without_rest())
    expected = turned(relaxed_at(-3e-6), Turn(0.019997, 0.0))
    assert positions(found.branch) == pytest.approx(positions(expected), abs=1e-12)


def test_an_axis_that_stayed_or_went_on_has_turned_nowhere() -> None:
    for moved_m in (0.0, 5e-6):
        found = powered_again(BEFORE, moved_m, 0.02 + moved_m)
        assert found.direction == 1.0
        assert positions(found.branch) == pytest.approx(positions(BEFORE.branch))


@pytest.mark.parametrize("moved_m", [1.01 * SPRING_BACK_M, -0.3, math.nan])
def test_an_axis_that_was_moved_is_at_rest_without_a_memory(moved_m: float) -> None:
    assert powered_again(BEFORE, moved_m, 0.01) == at_rest(0.01)
    assert powered_again(at_rest(0.02), -8e-6, 0.01) == at_rest(0.01)


def there_and_back(ways_m: list[float], reverse_m_s2: float = 0.02) -> np.ndarray:
    """Motions of half a cosine that reverse without a rest, at this acceleration."""
    parts, begin_m = [np.zeros((50, 4))], 0.0
    for way_m in ways_m:
        rate = math.sqrt(2.0 * reverse_m_s2 / abs(way_m))
        samples = math.ceil(math.pi / rate / T)
        angle, rate = np.pi * np.arange(1, samples + 1) / samples, math.pi / samples / T
        shape = (1.0 - np.cos(angle), rate * np.sin(angle), rate**2 * np.cos(angle), 0.0 * angle)
        part = 0.5 * way_m * np.column_stack(shape)
        part[:, 0] += begin_m
        parts.append(part)
        begin_m += way_m
    return np.concatenate(parts)


def within_100_um(level_n: float) -> AxisParams:
    """A waveform that ends 100 um behind a reversal."""
    ends = round((AHEAD_S + math.sqrt(2.0 * 100e-6 / 0.01)) / T)
    level = tuple(np.where(np.arange(480) < ends, level_n, 0.0).tolist())
    return with_waveform(PARAMS, (0.0,) * 7, wave_table((0.01,), (level,)))


def test_where_a_short_motion_has_come_back_the_waveform_is_as_if_it_had_not_been() -> None:
    before = there_and_back([5e-3, -30e-6])
    commands = there_and_back([5e-3, -30e-6, 5e-3])
    force_n = force_along(within_100_um(3.0), commands)
    way_m = commands[:, 0] - 5e-3
    returning = np.arange(len(way_m)) > len(before)
    returning[-40:] = False  # there the end of the motion is taken for a reversal
    held_n = force_n[returning & (way_m < -2e-6)]
    assert np.abs(held_n).max() < 1e-9  # -3 N of the short motion, 3 N of the way back
    assert np.abs(force_n[returning & (way_m > 2e-6)]).max() < 1e-9


def test_a_waveform_stays_where_the_axis_stops_and_begins_there() -> None:
    commands = there_and_back([5e-3, -30e-6])
    rest = np.tile([commands[-1, 0], 0.0, 0.0, 0.0], (100, 1))
    assert force_along(within_100_um(3.0), np.concatenate([commands, rest]))[-50:] == pytest.approx(-3.0)


def test_without_a_motion_since_power_came_no_force_is_left() -> None:
    state = powered_again(BEFORE, -8e-6, 0.019992)
    params = within_100_um(3.0)
    resting = AxisSample(0.019992, 0.0, 0.0, 0.0, 0.019992, 0.019992, 0.0)
    still = trapezoidal_pulse.at_rest(0.019992)
    force_n, now = planned_force(params.waveform, state, still, resting, T)
    assert (force_n, now.branch) == (0.0, state.branch)
    moving = still._replace(direction=-1.0)
    assert planned_force(params.waveform, state, moving, resting, T)[0] == pytest.approx(-3.0)
