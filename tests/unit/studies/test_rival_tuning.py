"""Rivals of the learned waveform: one rule of tuning, and published loops as gains of our law."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from axis_state_space import law_of, law_with_observer, plant_of, radius

from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.control.loop_margins import all_frequencies_hz, open_loop
from servo_ctrl.control.modal_model import ModalModel
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


def eigenvalue_radius(params: AxisParams) -> float:
    """The spectral radius of the closed loop on the rigid mass of the feedforward, in state space."""
    mass_kg = params.feedforward.acceleration_kg
    law = law_with_observer(params) if params.observer.enabled else law_of(params)
    return radius((plant_of(ModalModel(T, 1.0 / mass_kg, 1.0 / mass_kg, 0.0, 0.0, (), 0.0)), law))


def random_rival(base: AxisParams, rng: np.random.Generator) -> AxisParams | None:
    """A setting of a rival, from slow to far too fast."""
    rate_1_s, ratio = float(np.exp(rng.uniform(math.log(40.0), math.log(2e4)))), float(rng.uniform(0.3, 5.0))
    slope_1_s = float(rng.uniform(10.0, 400.0))
    kind = rng.integers(3)
    if kind == 0:
        return sliding_mode_params(
            base, slope_1_s, rate_1_s, float(rng.uniform(0.05, 0.5)) * rate_1_s * slope_1_s
        )
    if kind == 1:
        return disturbance_rejection_params(base, rate_1_s, ratio * rate_1_s)
    return with_bandwidth(base, rate_1_s / (2.0 * math.pi))


def test_ms_of_a_rival_is_infinite_where_the_eigenvalues_say_unstable(tuner: Tuner) -> None:
    rng, stable, flat = np.random.default_rng(17), [], []
    for _ in range(120):
        params = random_rival(tuner.params, rng)
        if params is None or abs((largest := eigenvalue_radius(params)) - 1.0) < 1e-4:
            continue
        assert math.isfinite(robustness(params)["Ms"]) is (largest < 1.0)
        stable.append(largest < 1.0)
        if largest > 1.0:
            loop = open_loop(params, params.feedforward.acceleration_kg, all_frequencies_hz(T))
            flat.append(np.abs(1.0 / (1.0 + loop)).max() < SENSITIVITY_LIMIT)
            assert not tuner.allows(params)
    assert 0.2 < np.mean(stable) < 0.8
    assert any(flat)  # unstable, and |S| alone would have passed


def published_params(base: AxisParams, name: str, setting: dict[str, float]) -> AxisParams:
    """The loop of a published setting."""
    if name == "sliding mode":
        rate_1_s, slope_1_s = setting["K_1_s"], setting["lambda_1_s"]
        params = sliding_mode_params(
            base, slope_1_s, rate_1_s, setting["adaptation_share"] * rate_1_s * slope_1_s
        )
        assert params is not None
        return params
    if name == "active disturbance rejection":
        return disturbance_rejection_params(base, setting["w_c_1_s"], setting["w_o_1_s"])
    return with_bandwidth(base, setting["bandwidth_hz"]) if "bandwidth_hz" in setting else base


@pytest.mark.parametrize("axis", list(MACHINE.axes))
def test_every_published_setting_is_stable_by_its_eigenvalues_with_the_published_ms(axis: str) -> None:
    base = axis_params(MACHINE, axis)
    published = json.loads((XY_TABLE.parents[1] / "docs" / "friction_waveforms.json").read_text("utf-8"))
    for rival in published["rivals"]:
        for entry in rival["curve"][axis]:
            params = published_params(base, rival["name"], entry)
            assert eigenvalue_radius(params) < 1.0
            assert robustness(params)["Ms"] == pytest.approx(entry["Ms"], rel=1e-3)  # settings are rounded


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
