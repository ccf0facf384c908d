"""Waveforms that production changes: what a reversal makes of them, and changes that are taken back."""

from pathlib import Path

import numpy as np
import pytest
from waveform_examples import example_waveform

from servo_ctrl.config.learning import waveform_settings
from servo_ctrl.config.load import load_machine
from servo_ctrl.learning.level_over_temperature import LevelNode, LevelSchedule, level_at
from servo_ctrl.learning.reversal_waveform import LoopModel
from servo_ctrl.learning.waveform_adaptation import (
    GAIN,
    LEVEL_RANGE,
    PATIENCE,
    AdaptationState,
    ProductionReversal,
    at_temperature,
    corrected_by,
    next_state,
)
from servo_ctrl.learning.waveform_level import at_level, scaled

LOOP = waveform_settings(load_machine(Path(__file__).parents[3] / "machines" / "xy_table"), "x").loop
AT = 0.1


def answered(loop: LoopModel, force_n: np.ndarray) -> np.ndarray:
    """The error (n,) that a missing force leaves, by the loop's differential equation."""
    error_m, speed, integral = np.zeros(len(force_n)), 0.0, 0.0
    for k in range(1, len(force_n)):
        integral += error_m[k - 1] * loop.period_s
        pull_n = force_n[k] - (loop.kv_n_s_m * loop.kp_1_s + loop.ki_n_m) * error_m[k - 1]
        pull_n -= loop.kv_n_s_m * speed + loop.ki_n_m * loop.kp_1_s * integral
        speed += pull_n / loop.mass_kg * loop.period_s
        error_m[k] = error_m[k - 1] + speed * loop.period_s
    return error_m


def reversal(force_n: np.ndarray) -> ProductionReversal:
    trace_m = answered(LOOP, force_n)
    return ProductionReversal(AT, trace_m, float(np.mean(np.abs(trace_m))))


def grown(share: float) -> np.ndarray:
    """What is missing where friction has grown by a share."""
    distance_m = 0.5 * AT * (np.arange(194) * LOOP.period_s) ** 2
    levels = example_waveform().friction[:4]
    parts = [2.0 * w * -np.expm1(-distance_m / slip) for w, slip in zip(levels, LOOP.slip_m, strict=True)]
    return np.asarray(share * np.sum(parts, axis=0))


def test_friction_that_has_grown_is_seen_as_that_and_scales_all_that_was_learned() -> None:
    state = AdaptationState(example_waveform())
    after = next_state(state, LOOP, reversal(grown(0.8)))
    assert after.level == pytest.approx(1.0 + GAIN * 0.8, rel=0.15)
    ratio = np.array(after.learned.friction[:4]) / np.array(state.learned.friction[:4])
    assert ratio == pytest.approx(after.level)
    assert after.learned.friction[4:] == state.learned.friction[4:]


def test_a_force_that_is_missing_for_a_while_goes_into_the_waveforms_beside_it() -> None:
    time_s = np.arange(194) * LOOP.period_s
    missing_n = 2.0 * np.sin(np.pi * np.clip((time_s - 0.05) / 0.08, 0.0, 1.0)) ** 2
    learned, level = corrected_by(AdaptationState(example_waveform()), LOOP, reversal(missing_n))
    base = scaled(example_waveform(), level)
    added = np.array(learned.waves_n) - np.array(base.waves_n)
    share = np.log(AT / 0.05) / np.log(0.4 / 0.05)
    assert added[0].max() == pytest.approx(GAIN * (1.0 - share) * 2.0, rel=0.25)
    assert added[1].max() == pytest.approx(GAIN * share * 2.0, rel=0.25)
    assert added[:, :20] == pytest.approx(0.0, abs=1e-4)  # what no trace shows stays as it is


def test_a_change_that_makes_it_worse_is_taken_back_and_the_next_is_smaller() -> None:
    first = next_state(AdaptationState(example_waveform()), LOOP, reversal(grown(0.2)))
    worse = next_state(first, LOOP, reversal(grown(0.3)))
    assert worse.learned == example_waveform()
    assert worse.gain == 0.5 * GAIN
    assert worse.before is None
    jumped = next_state(first, LOOP, reversal(grown(2.0)))  # that is not ours: learn on at full gain
    assert (jumped.learned, jumped.gain) == (example_waveform(), GAIN)


def test_another_acceleration_neither_judges_a_change_nor_makes_one_before_it_is_judged() -> None:
    first = next_state(AdaptationState(example_waveform()), LOOP, reversal(grown(0.2)))
    faster = reversal(grown(0.9))._replace(acceleration_m_s2=0.3)
    other = next_state(first, LOOP, faster)
    assert other == first._replace(waited=1)
    for _ in range(PATIENCE):  # production has gone on to another acceleration: it learns there
        other = next_state(other, LOOP, faster)
    assert other.level > 1.3 * first.level
    assert (other.acceleration_m_s2, other.waited) == (0.3, 0)


def test_what_is_good_enough_is_left_alone_and_the_level_stays_within_its_bounds() -> None:
    state = AdaptationState(example_waveform())
    assert next_state(state, LOOP, reversal(grown(0.001))).learned is state.learned
    huge = corrected_by(state._replace(level=4.9), LOOP, reversal(grown(5.0)))[1]
    assert huge == LEVEL_RANGE[1]


def test_no_change_below_the_slowest_acceleration_that_was_learned() -> None:
    slow = reversal(grown(0.5))._replace(acceleration_m_s2=0.01)
    assert corrected_by(AdaptationState(example_waveform()), LOOP, slow)[0] == example_waveform()


def test_with_a_temperature_a_small_change_is_one_of_friction_and_goes_into_the_table() -> None:
    small = reversal(grown(0.04))
    assert next_state(AdaptationState(example_waveform()), LOOP, small).level == 1.0
    warm = next_state(AdaptationState(example_waveform()), LOOP, small._replace(temperature_degc=30.0))
    assert warm.level == pytest.approx(1.0 + GAIN * 0.04, rel=0.15)
    assert level_at(warm.schedule.nodes, 30.0) == pytest.approx(1.04, rel=0.01)


def test_a_reversal_whose_correction_is_taken_back_is_not_in_the_table() -> None:
    first = next_state(AdaptationState(example_waveform()), LOOP, reversal(grown(0.2)))
    worse = next_state(first, LOOP, reversal(grown(0.3))._replace(temperature_degc=30.0))
    assert worse.schedule == first.schedule


def test_the_level_follows_the_temperature_within_its_bounds_and_a_correction_is_taken_back_there() -> None:
    nodes = (LevelNode(20.0, 1.5, 0.1), LevelNode(40.0, 1.0, 0.1))
    schedule = LevelSchedule(nodes, followed=1.0, evidence=0.05)
    state = next_state(AdaptationState(example_waveform(), schedule=schedule), LOOP, reversal(grown(0.2)))
    cold = at_temperature(state, LOOP, 20.0, 60.0)
    assert cold.level == pytest.approx(1.5 * state.level)
    assert cold.learned == at_level(state.learned, LOOP, cold.level / state.level)
    undone = next_state(cold, LOOP, reversal(grown(0.3)))
    assert undone.level == pytest.approx(1.5)
    assert undone.learned.friction[:4] == pytest.approx([1.5 * n for n in example_waveform().friction[:4]])
    assert at_temperature(state._replace(level=4.9), LOOP, 20.0, 60.0).level == LEVEL_RANGE[1]
    assert at_temperature(state, LOOP, float("nan"), 60.0) is state
