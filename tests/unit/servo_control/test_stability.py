"""Nyquist's criterion against the eigenvalues of closed loops in state space (`axis_state_space`)."""

import math
from pathlib import Path

import numpy as np
import pytest
from axis_state_space import T, coupled_radius, law_of, law_with_observer, plant_of, radius, series

from servo_ctrl.config.kernel_params import axis_params, with_observer
from servo_ctrl.config.load import load_machine
from servo_ctrl.control.axis_loop import coupled_loop_of, integrators_of, loop_of
from servo_ctrl.control.compensation import notch
from servo_ctrl.control.contour_control import Params as Contour
from servo_ctrl.control.contour_margin import coupled_sensitivity_peak, stable_alone
from servo_ctrl.control.modal_model import ModalModel, StructuralMode, grid_hz, with_modes
from servo_ctrl.control.stability import is_stable
from servo_ctrl.control.tick import AxisParams


def random_axis(base: AxisParams, rng: np.random.Generator) -> tuple[AxisParams, ModalModel]:
    """An axis whose gains are between much too low and much too high."""
    mass_kg = rng.uniform(40.0, 120.0)
    modes = tuple(
        StructuralMode(
            float(rng.uniform(15.0, 200.0)),
            float(np.exp(rng.uniform(math.log(0.004), math.log(0.2)))),
            float(rng.uniform(0.0, 1.0)) / mass_kg,
            float(rng.uniform(-1.0, 1.0)) / mass_kg,
        )
        for _ in range(rng.integers(0, 3))
    )
    friction_1_s, delay_s = float(rng.choice([0.0, 0.5, 5.0])), float(rng.uniform(0.0, 2.5e-3))
    model = ModalModel(T, 1.0 / mass_kg, 1.0 / mass_kg, friction_1_s, delay_s, modes, 0.0)
    kv = mass_kg * float(np.exp(rng.uniform(math.log(30.0), math.log(1500.0))))
    filters = notch.NEUTRAL
    if rng.random() < 0.5:
        filters = notch.biquad(float(rng.uniform(20.0, 200.0)), 0.4, 0.1, T)
    params = base._replace(
        position_loop=base.position_loop._replace(
            kp_1_s=float(np.exp(rng.uniform(math.log(3.0), math.log(300.0)))),
            ki_1_s2=float(rng.choice([0.0, 50.0])),
            kd=float(rng.choice([0.0, 0.1])),
            derivative_blend=0.5,
            scale_feedback=True,
        ),
        velocity_loop=base.velocity_loop._replace(
            kv_n_s_m=kv,
            ki_n_m=float(rng.uniform(5.0, 60.0)) * kv,
            window_samples=int(rng.integers(1, 3)),
            filter_blend=float(rng.choice([1.0, 0.6])),
        ),
        notch=filters,
    )
    return params, model


@pytest.fixture(scope="module")
def base() -> AxisParams:
    machine = load_machine(Path(__file__).parents[3] / "machines" / "xy_table")
    return with_observer(axis_params(machine, "x"), enabled=False)


def test_it_says_what_the_eigenvalues_say_of_random_axes(base: AxisParams) -> None:
    rng, seen = np.random.default_rng(11), []
    for _ in range(150):
        params, model = random_axis(base, rng)
        largest = radius((plant_of(model), law_of(params)))
        if abs(largest - 1.0) < 3e-4:
            continue  # nearer to the border than the sum over aliases is exact
        plant = model.plant(grid_hz(model), scale_feedback=True)
        assert is_stable(1.0 + loop_of(params, plant), integrators_of(params)) is bool(largest < 1.0)
        seen.append(largest < 1.0)
    assert 0.2 < np.mean(seen) < 0.8


def test_the_response_of_the_matrices_is_that_of_the_loop(base: AxisParams) -> None:
    rng = np.random.default_rng(12)
    for _ in range(5):
        params, model = random_axis(base, rng)
        whole = series(plant_of(model), law_of(params))
        hz = np.array([3.0, 31.0, 170.0])
        z = np.exp(2j * math.pi * hz * T)
        expected = [whole.c @ np.linalg.solve(x * np.eye(len(whole.a)) - whole.a, whole.b) for x in z]
        plant = model.plant(hz, scale_feedback=True)
        assert loop_of(params, plant) == pytest.approx(np.ravel(expected), rel=2e-3)


def test_so_it_is_for_two_coupled_axes_in_any_direction(base: AxisParams) -> None:
    rng, seen = np.random.default_rng(13), []
    while len(seen) < 24:
        axes = [random_axis(base, rng) for _ in range(2)]
        if max(radius((plant_of(model), law_of(params))) for params, model in axes) > 1.0 - 1e-5:
            continue
        kp_1_s = float(np.exp(rng.uniform(0.0, math.log(200.0))))
        contour = Contour(kp_1_s, float(rng.choice([0.0, 20.0])), 1.0, 1e-3, T)
        largest = coupled_radius(axes, contour)
        if abs(largest - 1.0) < 1e-5:
            continue
        hz = with_modes(grid_hz(axes[0][1]), [axes[1][1]])
        plants = [model.plant(hz, scale_feedback=True) for _, model in axes]
        found = coupled_sensitivity_peak(contour, axes[0][0], axes[1][0], *plants)
        assert math.isinf(found) is bool(largest > 1.0)
        seen.append(largest < 1.0)
    assert 0.1 < np.mean(seen) < 0.9


@pytest.mark.parametrize("share", [0.2, 0.5, 1.0, 2.0, 4.0])
def test_an_observer_is_judged_by_what_it_makes_of_a_stable_loop(base: AxisParams, share: float) -> None:
    """Of a rigid mass: a model with far too much mass makes the loop unstable, as its eigenvalues say."""
    mass_kg, hz = 70.0, np.geomspace(0.02, 499.99, 3000)
    observer = base.observer._replace(enabled=True, mass_kg=share * mass_kg, filter_blend=0.3)
    params = base._replace(observer=observer)
    rigid = ModalModel(T, 1.0 / mass_kg, 1.0 / mass_kg, 0.0, 0.0, (), 0.0)
    plant = rigid.plant(hz, scale_feedback=True)
    largest = radius((plant_of(rigid), law_with_observer(params)))
    assert stable_alone(params, plant) is bool(largest < 1.0)
    assert np.isfinite(coupled_loop_of(params, plant).loop).all()


def test_a_loop_of_negative_gain_is_not_stable() -> None:
    z = np.exp(2j * math.pi * np.geomspace(0.02, 499.99, 2000) * T)
    assert is_stable(1.0 + 0.1 / (z - 1.0), 1)
    assert not is_stable(1.0 - 0.1 / (z - 1.0), 1)
    assert not is_stable(1.0 + 3.0 / (z - 1.0), 1)
    assert not is_stable(1.0 - 2.0 / (z - 0.5), 0)
    assert is_stable(1.0 - 0.2 / (z - 0.5), 0)
