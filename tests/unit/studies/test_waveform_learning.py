"""Learned waveform compensation: closed forms of its parts, convergence, and motions outside the learning."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kernels.arrays import Array
from kernels.record_layout import store
from servo_ctrl.config.learning import waveform_settings
from servo_ctrl.config.load import load_machine
from servo_ctrl.control.compensation.learned_waveform import State, powered_again
from servo_ctrl.control.presliding_memory import Branch, Turn
from servo_ctrl.control.rest_memory import Rest
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.learning import waveform_run
from servo_ctrl.learning.reversal_waveform import (
    FILTER_HZ,
    LoopModel,
    corrected,
    identify_friction,
    missing_force_n,
    presliding_states,
)
from servo_ctrl.learning.waveform_run import WaveformRun, extrapolated_waveform
from servo_ctrl.learning.waveform_stroke import GAIN
from servo_ctrl.motion.move import Move
from studies.feng_2015.rival_tuning import Setting, Tuner
from studies.feng_2015.waveform_drift import BEFORE, recovery
from studies.feng_2015.waveform_learning import ErrorStrokes, LearnedWaveforms, learn_waveforms, with_learned
from studies.twin_axis import TwinAxis, motion, twin_axis
from twin.plant_file import load_plant

XY_TABLE = Path(__file__).parents[3] / "machines" / "xy_table"
MACHINE, PLANT = load_machine(XY_TABLE), load_plant(XY_TABLE)
T = 1e-3
LOOP = waveform_settings(MACHINE, "x").loop


def sine(radius_m: float = 0.01, speed_rad_s: float = 2.0) -> np.ndarray:
    angle = speed_rad_s * np.arange(6000) * T
    motion = (np.sin(angle), speed_rad_s * np.cos(angle), -(speed_rad_s**2) * np.sin(angle), 0.0 * angle)
    return radius_m * np.column_stack(motion)


@pytest.fixture(scope="module")
def learned() -> LearnedWaveforms:
    """Learn five accelerations, with five strokes each."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(waveform_run, "ACCELERATIONS", 5)
        patch.setattr(waveform_run, "ITERATIONS", 5)
        return learn_waveforms(MACHINE, PLANT, "x")


def test_a_memory_relaxes_over_its_slip_distance_and_knows_no_time() -> None:
    for step_m in (1e-7, 1e-6):
        path_m = np.arange(0.0, 50e-6, step_m)
        expected = [-math.expm1(-path_m[-1] / slip) for slip in LOOP.slip_m]
        assert presliding_states(LOOP, path_m)[-1] == pytest.approx(expected)


def test_the_missing_force_is_the_disturbance_that_made_the_error() -> None:
    f_hz, force_n = 3.0, 5.0  # answer of the loop to a sine of force, by its transfer function
    s = 2j * math.pi * f_hz
    rest = LOOP.kv_n_s_m * s + LOOP.kv_n_s_m * LOOP.kp_1_s + LOOP.ki_n_m + LOOP.ki_n_m * LOOP.kp_1_s / s
    answer = force_n / (LOOP.mass_kg * s**2 + rest)
    wave = np.exp(s * np.arange(4000) * T)
    found_n = missing_force_n(LOOP, (answer * wave).imag)
    found_n -= found_n[500:3500].mean()
    assert found_n[500:3500] == pytest.approx(force_n * wave.imag[500:3500], abs=0.02 * force_n)


def test_friction_that_was_put_in_is_identified() -> None:
    levels, slopes = (3.0, 0.0, 5.0, 0.0), (-200.0, 2.0, 0.1)
    strokes = [stroke_with(levels, slopes, sine(speed_rad_s=speed)) for speed in (2.0, 6.0)]
    found = identify_friction(LOOP, strokes)
    assert sum(found[:4]) == pytest.approx(8.0, rel=0.05)
    assert found[4] == pytest.approx(-200.0, rel=0.02)
    assert found[5] == pytest.approx(2.0, abs=0.2)  # kg
    assert found[6] == pytest.approx(0.1, abs=0.03)  # kg s; the loop here is a period late


def stroke_with(
    levels: tuple[float, ...], slopes: tuple[float, ...], commands: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The commands, and the error of a loop that misses these forces."""
    motion = np.column_stack([commands[:, 1:3], np.gradient(commands[:, 2], T)])
    wanted_n = presliding_states(LOOP, commands[:, 0]) @ np.array(levels) + motion @ np.array(slopes)
    error_m = np.zeros(len(wanted_n))
    speed = integral = 0.0
    for k in range(1, len(error_m)):  # the loop's differential equation, explicitly
        integral += error_m[k - 1] * T
        stiff_n = (LOOP.kv_n_s_m * LOOP.kp_1_s + LOOP.ki_n_m) * error_m[k - 1]
        pull_n = wanted_n[k] - stiff_n - LOOP.kv_n_s_m * speed - LOOP.ki_n_m * LOOP.kp_1_s * integral
        speed += pull_n / LOOP.mass_kg * T
        error_m[k] = error_m[k - 1] + speed * T
    return commands, error_m


def contraction(loop: LoopModel, mass_share: float, gain: float, frequency_hz: Array) -> Array:
    """|Q (1 - g P / P_model)|, (n,), for `mass_share` times the model's mass; below 1, learning converges."""
    s = 2j * math.pi * frequency_hz
    feedback = loop.kv_n_s_m * s + loop.kv_n_s_m * loop.kp_1_s + loop.ki_n_m + loop.ki_n_m * loop.kp_1_s / s
    ratio = (loop.mass_kg * s**2 + feedback) / (mass_share * loop.mass_kg * s**2 + feedback)
    low_pass = np.exp(-0.5 * (frequency_hz / FILTER_HZ) ** 2)
    return np.asarray(np.abs(low_pass * (1.0 - gain * low_pass * ratio)))


@pytest.mark.parametrize("axis", ["x", "y"])
def test_learning_contracts_at_every_frequency_with_half_or_twice_the_mass(axis: str) -> None:
    loop = waveform_settings(MACHINE, axis).loop
    frequency_hz = np.geomspace(0.01, 500.0, 3000)
    for share in (0.5, 0.7, 1.0, 1.3, 2.0):
        assert contraction(loop, share, GAIN, frequency_hz).max() < 0.7


def test_above_what_was_learned_a_waveform_goes_on_over_the_same_distance() -> None:
    settings = waveform_settings(MACHINE, "x")
    ahead, dead = round(LOOP.ahead_s / T), LOOP.dead_samples
    low_n, high_n = np.zeros(480), np.zeros(480)
    low_n[ahead - dead :], high_n[ahead - dead :] = 1.0, 1.3
    pair = {0.1: tuple(low_n), 0.2: tuple(high_n)}
    [(a_m_s2, wave_n)] = extrapolated_waveform(pair, settings._replace(limit_m_s2=0.8)).items()
    assert (a_m_s2, wave_n[ahead - dead - 1]) == (0.8, 0.0)
    assert wave_n[ahead - dead + 1] == pytest.approx(1.3**3, rel=1e-3)  # 1.3 for each doubling
    end = ahead - dead + (479 - ahead + dead) // 2
    assert (wave_n[end] > 2.0, wave_n[end + 1]) == (True, 0.0)  # at 4 times a, half the time
    falling = {0.1: tuple(high_n), 0.2: tuple(low_n)}
    assert max(extrapolated_waveform(falling, settings._replace(limit_m_s2=0.8))[0.8]) == 1.0
    assert extrapolated_waveform(pair, settings._replace(limit_m_s2=0.15)) == {}


def test_noise_in_the_error_does_not_grow_from_stroke_to_stroke() -> None:
    rng = np.random.default_rng(24)
    wave_n, sizes = np.zeros(480), []
    for _ in range(30):
        missing_n = missing_force_n(LOOP, rng.normal(0.0, 0.03e-6, 480)) - wave_n
        wave_n = corrected(wave_n, missing_n, GAIN, LOOP)
        sizes.append(float(np.sqrt(np.mean(wave_n**2))))
    assert np.mean(sizes[20:]) < 2.0 * np.mean(sizes[:5]) + 0.1


def test_strokes_of_the_table_take_nine_tenths_of_the_error_away(learned: LearnedWaveforms) -> None:
    assert learned.learned.strokes == len(learned.course) <= 5 * 5 + 4
    assert learned.learned.after_m < 0.1 * learned.learned.before_m
    *tried_at, beyond_m_s2 = learned.learned.accelerations_m_s2
    assert beyond_m_s2 == 1e-3 * MACHINE.axes["x"].limits.acceleration_mm_s2
    for a_m_s2 in tried_at:
        tried = [j for stage, a, j in learned.course if (stage, a) == ("waveform", a_m_s2)]
        assert min(tried) < 0.15e-6 + 0.1 * tried[0]
        assert tried == pytest.approx(sorted(tried, reverse=True), abs=0.05e-6)
    tuner = Tuner(MACHINE, PLANT, "x")
    unseen_m_s2 = 0.05
    without_um = tuner.evaluation_um(Setting({}, tuner.params), unseen_m_s2)
    ours = with_learned(tuner.params, learned.learned)
    assert tuner.evaluation_um(Setting({}, ours), unseen_m_s2) < 0.1 * without_um


@pytest.mark.parametrize("level_factor", [0.6, 1.8])
def test_friction_that_changes_is_learned_from_production_alone(
    learned: LearnedWaveforms, level_factor: float
) -> None:
    course = recovery(MACHINE, PLANT, "x", learned.learned, 2.0 / 60.0, level_factor=level_factor, after=20)
    stale_m, adapted_m = np.array(course.stale_m), np.array(course.adapted_m)
    assert stale_m[BEFORE:].min() > 2.5e-6
    assert adapted_m[-3:].max() < 0.1 * stale_m[-1]
    assert (adapted_m < 1.1 * stale_m + 0.05e-6).all()  # never worse than without learning


def test_a_run_that_is_over_takes_no_more_strokes(learned: LearnedWaveforms) -> None:
    strokes = ErrorStrokes(MACHINE, PLANT, "x")
    run = WaveformRun(strokes.settings)
    assert run.stroke is not None
    result = strokes.stroke(run.stroke)
    assert (run.outlook.stage, run.outlook.strokes_done, run.outlook.strokes_total) == ("identify", 0, 58)
    run.take(result)
    assert run.outlook.strokes_done == 1
    assert run.learned is None
    assert learned.learned.machine_time_s > 100.0


OFF_CYCLES, SETTLED_CYCLES, PEAK_CYCLES = 500, 30, 200
"""Without power, until friction has sprung back; until control has begun; of a start, whose peak is taken."""


def move(to_m: float) -> Array:
    """A move of x from 0."""
    feed_m_s, acceleration_m_s2 = 0.03, 0.5
    return motion(MACHINE, "x", [Move("start", (to_m, math.nan), feed_m_s, acceleration_m_s2, False)])


def branch_of(values: list[Any]) -> Branch:
    """A memory from the values of its record."""
    return Branch(values[0], *(Turn(*turn) for turn in values[1:]))


def wound_up(params: AxisParams) -> tuple[TwinAxis, float]:
    """The axis with power again, after a move in + direction; and how far it moved without, m."""
    before, after = (twin_axis(MACHINE, PLANT, "x", params) for _ in range(2))
    before.rollout.rows(move(0.02))
    after.plant_state["presliding_gms"] = before.plant_state["presliding_gms"]
    after.rollout.rows(np.zeros((OFF_CYCLES + SETTLED_CYCLES, 4)), off_cycles=OFF_CYCLES)
    moved_m = float(after.plant_state["table_position_m"])
    values = before.rollout._records["law"]["state"]["waveform"][0].tolist()
    state = State(*values[:3], branch_of(values[3]), *values[4:8], Rest(*values[8]))
    store(after.rollout._records["law"]["state"]["waveform"], [powered_again(state, moved_m, 0.0)])
    return after, moved_m


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_start_from_wound_up_friction_is_known(learned: LearnedWaveforms, direction: float) -> None:
    reference, peaks_m = move(direction * 0.02), []
    begins = int(np.flatnonzero(reference[:, 0])[0])
    plain = ErrorStrokes(MACHINE, PLANT, "x").params
    for params in (plain, with_learned(plain, learned.learned)):
        axis, moved_m = wound_up(params)
        assert -50e-6 < moved_m < -2e-6
        error_m = np.abs(axis.rollout.rows(reference)["position_error_m"])
        peaks_m.append(float(error_m[begins : begins + PEAK_CYCLES].max()))
    without_m, with_m = peaks_m
    assert with_m < (0.45 if direction > 0.0 else 0.15) * without_m
