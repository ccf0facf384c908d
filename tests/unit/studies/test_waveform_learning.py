"""Learned waveform compensation: closed forms of its parts, convergence, and motions that no learning saw."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from servo_ctrl.config.freeze import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.learning.performance import reversals
from servo_ctrl.learning.reversal_waveform import (
    AHEAD_S,
    SLIP_M,
    FrictionMemory,
    LoopModel,
    ReversalWaveforms,
    compensation_n,
    contraction,
    corrected,
    identified,
    memories,
    missing_force_n,
    waveform_at,
)
from studies.feng_2015 import waveform_learning
from studies.feng_2015.rivals import Setting, Tuner, planned_n, with_bandwidth
from studies.feng_2015.waveform_learning import friction_alone, identify, learn_waveforms
from studies.feng_2015.waveform_robustness import markdown
from twin.plant_file import load_plant

XY_TABLE = Path(__file__).parents[3] / "machines" / "xy_table"
MACHINE, PLANT = load_machine(XY_TABLE), load_plant(XY_TABLE)
T = 1e-3
LOOP = LoopModel(70.0, 38.7, 14_700.0, 525_000.0, T, 3)
NO_FRICTION = FrictionMemory((0.0,) * len(SLIP_M), 0.0, 0.0)


def sine(radius_m: float = 0.01, speed_rad_s: float = 2.0) -> np.ndarray:
    angle = speed_rad_s * np.arange(6000) * T
    motion = (np.sin(angle), speed_rad_s * np.cos(angle), -(speed_rad_s**2) * np.sin(angle), 0.0 * angle)
    return radius_m * np.column_stack(motion)


def test_a_memory_relaxes_over_its_slip_distance_and_knows_no_time() -> None:
    for step_m in (1e-7, 1e-6):
        path_m = np.arange(0.0, 50e-6, step_m)
        assert memories(path_m)[-1] == pytest.approx([-math.expm1(-path_m[-1] / slip) for slip in SLIP_M])


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
    put_in = FrictionMemory((3.0, 0.0, 5.0, 0.0), -200.0, 2.0)
    commands = sine()
    wanted_n = memories(commands[:, 0]) @ np.array(put_in.level_n) + commands[:, 1:3] @ np.array(put_in[1:])
    error_m = np.zeros(len(wanted_n))
    speed = integral = 0.0
    for k in range(1, len(error_m)):  # the loop's differential equation, explicitly
        integral += error_m[k - 1] * T
        stiff_n = (LOOP.kv_n_s_m * LOOP.kp_1_s + LOOP.ki_n_m) * error_m[k - 1]
        pull_n = wanted_n[k] - stiff_n - LOOP.kv_n_s_m * speed - LOOP.ki_n_m * LOOP.kp_1_s * integral
        speed += pull_n / LOOP.mass_kg * T
        error_m[k] = error_m[k - 1] + speed * T
    found = identified(LOOP, [(commands, error_m)])
    assert sum(found.level_n) == pytest.approx(8.0, rel=0.05)
    assert found.per_speed_n_s_m == pytest.approx(-200.0, rel=0.2)


def test_the_compensation_is_bounded_and_begins_before_the_reversal() -> None:
    wave_n = np.full(200, 50.0)
    learned = ReversalWaveforms(NO_FRICTION, (0.04,), (wave_n,), 10.0, 3)
    commands = sine()
    force_n = compensation_n(learned, commands, T)
    reversal = int(reversals(commands[:, 0])[0])
    assert np.abs(force_n).max() == 10.0
    assert np.flatnonzero(force_n)[0] == reversal - round(AHEAD_S / T)
    assert force_n[reversal] == -10.0  # into the negative direction


def test_a_waveform_stretches_so_that_it_covers_the_same_distance() -> None:
    ahead = round(AHEAD_S / T)
    wave_n = np.concatenate([np.zeros(ahead), np.linspace(1.0, 0.0, 101)])
    learned = ReversalWaveforms(NO_FRICTION, (0.01, 0.04), (wave_n, wave_n), 10.0, 3)
    assert waveform_at(learned, 0.01, T)[ahead + 50] == pytest.approx(0.5)
    alone = ReversalWaveforms(NO_FRICTION, (0.01,), (wave_n,), 10.0, 3)
    assert waveform_at(alone, 0.04, T)[ahead + 50] == pytest.approx(0.5)  # held outside
    between = waveform_at(learned, 0.02, T)
    times = [50 * math.sqrt(0.02 / a) for a in (0.01, 0.04)]
    assert between[ahead + 50] == pytest.approx(np.mean([1.0 - time / 100.0 for time in times]))


@pytest.mark.parametrize("axis", ["x", "y"])
def test_learning_contracts_at_every_frequency_with_half_or_twice_the_mass(axis: str) -> None:
    loop = waveform_learning.loop_model(axis_params(MACHINE, axis))
    frequency_hz = np.geomspace(0.01, 500.0, 3000)
    for share in (0.5, 0.7, 1.0, 1.3, 2.0):
        assert contraction(loop, share, waveform_learning.GAIN, frequency_hz).max() < 0.7


def test_noise_in_the_error_does_not_grow_from_stroke_to_stroke() -> None:
    rng = np.random.default_rng(24)
    wave_n, sizes = np.zeros(480), []
    for _ in range(30):
        missing_n = missing_force_n(LOOP, rng.normal(0.0, 0.03e-6, 480)) - wave_n
        wave_n = corrected(wave_n, missing_n, waveform_learning.GAIN, LOOP)
        sizes.append(float(np.sqrt(np.mean(wave_n**2))))
    assert np.mean(sizes[20:]) < 2.0 * np.mean(sizes[:5]) + 0.1


def test_strokes_of_the_table_take_nine_tenths_of_the_error_away(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(waveform_learning, "ACCELERATIONS", 3)
    monkeypatch.setattr(waveform_learning, "ITERATIONS", 5)
    found = learn_waveforms(MACHINE, PLANT, "x")
    assert found.strokes == 3 * 5 + 2
    for course in found.course_m.values():
        assert min(course) < 0.15e-6 + 0.1 * course[0]
        assert course == pytest.approx(sorted(course, reverse=True), abs=0.05e-6)
    tuner = Tuner(MACHINE, PLANT, "x")
    unseen_m_s2 = 0.05
    without_um = tuner.evaluation_um(Setting({}, tuner.params), unseen_m_s2)
    with_um = tuner.evaluation_um(Setting({}, tuner.params, found.learned), unseen_m_s2)
    assert with_um < 0.1 * without_um


def test_a_rival_beyond_the_bound_of_robustness_does_not_count() -> None:
    tuner = Tuner(MACHINE, PLANT, "x")
    tuner.accelerations_m_s2 = [0.12]
    bandwidths_hz = (7.5, 30.0, 60.0)
    settings = [Setting({"bandwidth_hz": hz}, with_bandwidth(tuner.params, hz)) for hz in bandwidths_hz]
    tuned = tuner.best("observer", settings)
    assert tuned.curve[2]["Ms"] > 2.0
    assert tuned.setting.described["bandwidth_hz"] == 30.0


def test_an_observer_that_is_told_of_the_feedforward_gets_its_fast_part_only() -> None:
    strokes = waveform_learning.ErrorStrokes(MACHINE, PLANT, "x")
    friction = friction_alone(identify(strokes), strokes.params)
    params = with_bandwidth(strokes.params, 30.0)
    commands = sine()
    told_n = planned_n(Setting({}, params, friction, params.observer.filter_blend), commands)
    whole_n = planned_n(Setting({}, params, friction), commands)
    reversal = int(reversals(commands[:, 0])[0])
    assert abs(whole_n[reversal - 300]) > 5.0
    assert abs(told_n[reversal - 300]) < 0.5


def test_the_table_of_the_documents_is_the_committed_figures() -> None:
    docs = XY_TABLE.parents[1] / "docs"
    figures = json.loads((docs / "friction_waveforms.json").read_text(encoding="utf-8"))
    page = (docs / "friction_study.md").read_text(encoding="utf-8").splitlines()
    rows = [row for row in markdown(figures).splitlines() if row.strip("|- ")]
    first = page.index(rows[0])
    assert [row for row in page[first : first + len(rows) + 1] if row.strip("|- ")] == rows
