"""Rivals of the learned waveform: one rule of tuning, and published loops as gains of our law."""

from pathlib import Path

import numpy as np
import pytest

from servo_ctrl.config.load import load_machine
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.learning.performance import reversals
from studies.feng_2015.published_loops import (
    disturbance_rejection_params,
    sliding_mode,
    sliding_mode_params,
    with_bandwidth,
)
from studies.feng_2015.rival_tuning import (
    NOISE_SHARE,
    SENSITIVITY_LIMIT,
    Setting,
    Tuner,
    planned_n,
    robustness,
)
from studies.feng_2015.waveform_learning import ErrorStrokes, identify
from twin.plant_file import load_plant

XY_TABLE = Path(__file__).parents[3] / "machines" / "xy_table"
MACHINE, PLANT = load_machine(XY_TABLE), load_plant(XY_TABLE)
T = 1e-3


@pytest.fixture(scope="module")
def tuner() -> Tuner:
    return Tuner(MACHINE, PLANT, "x")


def gains(params: AxisParams) -> tuple[float, float, float]:
    """D, P and I of a position error, by mass."""
    kp, (kv, ki) = params.position_loop.kp_1_s, params.velocity_loop[:2]
    mass_kg = params.feedforward.acceleration_kg
    return kv / mass_kg, (kv * kp + ki) / mass_kg, ki * kp / mass_kg


def test_adaptive_sliding_mode_is_its_law_in_three_gains(tuner: Tuner) -> None:
    slope, rate, adaptation = 40.0, 150.0, 300.0
    params = sliding_mode_params(tuner.params, slope, rate, adaptation)
    assert params is not None
    # a* + slope e' + rate (e' + slope e) + adaptation int (e' + slope e)
    wanted = (slope + rate, rate * slope + adaptation, adaptation * slope)
    assert gains(params) == pytest.approx(wanted)
    assert sliding_mode_params(tuner.params, slope, rate, 4000.0) is None


def test_disturbance_rejection_has_a_double_pole_and_its_observer(tuner: Tuner) -> None:
    params = disturbance_rejection_params(tuner.params, 80.0, 200.0)
    assert gains(params) == pytest.approx((160.0, 6400.0, 0.0))
    assert params.observer.enabled
    assert params.observer == with_bandwidth(tuner.params, 200.0 / (2.0 * np.pi)).observer


def test_a_published_loop_is_as_fast_as_both_bounds_allow(tuner: Tuner) -> None:
    plain = robustness(tuner.params)
    found = [robustness(setting.params) for setting in sliding_mode(tuner)]
    assert len(found) > 10
    for entry in found:
        shares = entry["Ms"] / SENSITIVITY_LIMIT, entry["noise_n_um"] / (NOISE_SHARE * plain["noise_n_um"])
        assert 0.9 < max(shares) <= 1.0


def test_a_rival_beyond_the_bound_of_robustness_does_not_count() -> None:
    tuner = Tuner(MACHINE, PLANT, "x")
    tuner.accelerations_m_s2 = [0.12]
    bandwidths_hz = (7.5, 30.0, 60.0)
    settings = [Setting({"bandwidth_hz": hz}, with_bandwidth(tuner.params, hz)) for hz in bandwidths_hz]
    tuned = tuner.best("observer", settings)
    assert tuned.curve[2]["Ms"] > 2.0
    assert tuned.setting.described["bandwidth_hz"] == 30.0


def test_an_observer_that_knows_the_feedforward_compensates_its_fast_part_only() -> None:
    strokes = ErrorStrokes(MACHINE, PLANT, "x")
    friction = identify(strokes)
    params = with_bandwidth(strokes.params, 30.0)
    angle = 2.0 * np.arange(6000) * T
    commands = 0.01 * np.column_stack([np.sin(angle), 2.0 * np.cos(angle), -4.0 * np.sin(angle), 0.0 * angle])
    feedforward_n = planned_n(Setting({}, params, friction, params.observer.filter_blend), commands)
    whole_n = planned_n(Setting({}, params, friction), commands)
    reversal = int(reversals(commands[:, 0])[0])
    assert abs(whole_n[reversal - 300]) > 5.0
    assert abs(feedforward_n[reversal - 300]) < 0.5
