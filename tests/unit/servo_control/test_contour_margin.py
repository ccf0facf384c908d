"""The margin of two coupled axes: one axis as the special case, and the compiled laws at the border."""

import math
from pathlib import Path

import numpy as np
import pytest

from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.control.axis_loop import CoupledLoop, Plant, Response, rigid_plant
from servo_ctrl.control.contour_control import Pair, Params, at_rest, coupled
from servo_ctrl.control.contour_margin import (
    ANGLES_RAD,
    LoopPair,
    coupled_sensitivity_peak,
    direction_peak,
    largest_of_inverse,
    pair_sensitivity_peak,
)
from servo_ctrl.control.loop_margins import all_frequencies_hz, sensitivity_peak
from servo_ctrl.control.tick import AxisParams, axis_tick, initial_state
from servo_ctrl.control.types import AxisSample

MASSES_KG = 70.0, 89.6
HZ = np.geomspace(0.1, 499.99, 2000)


def plants(*masses_kg: float) -> list[Plant]:
    return [rigid_plant(1e-3, mass_kg, all_frequencies_hz(1e-3)) for mass_kg in masses_kg]


@pytest.fixture
def laws(machines: Path) -> tuple[AxisParams, AxisParams]:
    machine = load_machine(machines / "xy_table")
    return axis_params(machine, "x"), axis_params(machine, "y")


def contour(kp_1_s: float, ki_1_s2: float = 0.0) -> Params:
    return Params(kp_1_s, ki_1_s2, limit_m_s=1.0, full_speed_m_s=1e-6, period_s=1e-3)


@pytest.mark.parametrize("kp_1_s", [0.0, 40.0, 100.0])
def test_equal_axes_have_the_margin_of_one_with_both_gains(
    laws: tuple[AxisParams, AxisParams], kp_1_s: float
) -> None:
    one = laws[0]
    faster = one._replace(position_loop=one.position_loop._replace(kp_1_s=one.position_loop.kp_1_s + kp_1_s))
    peak = coupled_sensitivity_peak(contour(kp_1_s), one, one, *plants(70.0, 70.0))
    assert peak == pytest.approx(sensitivity_peak(faster, MASSES_KG[0]), rel=1e-7)  # two equal roots


def test_without_a_gain_it_is_that_of_the_worse_axis(laws: tuple[AxisParams, AxisParams]) -> None:
    alone = [sensitivity_peak(law, mass_kg) for law, mass_kg in zip(laws, MASSES_KG, strict=True)]
    assert coupled_sensitivity_peak(contour(0.0), *laws, *plants(*MASSES_KG)) == pytest.approx(
        max(alone), rel=1e-9
    )


def delayed_integrators(gain_1_s: float, contour_1_s: float) -> tuple[LoopPair, Response]:
    """Two unlike axes that are a velocity behind two delays, and W, at 1 kHz."""
    z = np.exp(2j * math.pi * HZ * 1e-3)
    plant = 1e-3 / (z - 1.0) / z**2
    pair = CoupledLoop(gain_1_s * plant, plant), CoupledLoop(0.7 * gain_1_s * plant, 0.8 * plant)
    return pair, np.full(len(HZ), contour_1_s + 0j)


def loop_matrices(pair: LoopPair, law: Response, angle_rad: float) -> np.ndarray:
    """L of both axes with the coupling, (n, 2, 2)."""
    normal = np.array([-math.sin(angle_rad), math.cos(angle_rad)])
    own = np.array([np.diag(one) for one in np.column_stack([axis.loop for axis in pair])])
    gains = np.array([np.diag(one) for one in np.column_stack([axis.per_gain for axis in pair])])
    return np.asarray(own + law[:, None, None] * gains @ np.outer(normal, normal))


@pytest.mark.parametrize("angle_rad", [0.0, 0.3, 0.25 * math.pi, 1.2])
def test_the_singular_values_are_those_of_the_matrix(angle_rad: float) -> None:
    pair, law = delayed_integrators(120.0, 90.0)
    matrices = np.eye(2) + loop_matrices(pair, law, angle_rad)
    expected = np.linalg.svd(np.linalg.inv(matrices), compute_uv=False)[:, 0]
    found = [largest_of_inverse(*matrix.ravel().tolist()) for matrix in matrices]
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    assert direction_peak(*pair, law, 0, angle_rad) == pytest.approx(expected.max(), rel=1e-9)


def test_equal_axes_at_45_degrees_have_one_value_along_the_path_and_one_beside_it() -> None:
    (one, _), law = delayed_integrators(120.0, 90.0)
    along, beside = 1.0 / np.abs(1.0 + one.loop), 1.0 / np.abs(1.0 + one.loop + one.per_gain * law)
    expected = max(along.max(), beside.max())
    assert direction_peak(one, one, law, 0, 0.25 * math.pi) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("contour_1_s", [300.0, 450.0, 480.0, 510.0, 700.0])
def test_a_pair_is_unstable_where_its_poles_are(contour_1_s: float) -> None:
    pair, law = delayed_integrators(120.0, contour_1_s)
    largest = 0.0
    for angle_rad in ANGLES_RAD.tolist():
        normal = np.array([-math.sin(angle_rad), math.cos(angle_rad)])
        feedback = np.diag([120.0, 84.0]) + contour_1_s * np.diag([1.0, 0.8]) @ np.outer(normal, normal)
        zero, one = np.zeros((2, 2)), np.eye(2)  # of the positions, and of the two delays
        states = np.block([[one, 1e-3 * one, zero], [zero, zero, one], [-feedback, zero, zero]])
        largest = max(largest, np.abs(np.linalg.eigvals(states)).max())
    assert math.isinf(pair_sensitivity_peak(pair, law, 0)) is bool(largest > 1.0)


def border_1_s(laws: tuple[AxisParams, AxisParams], ki_share_1_s: float) -> float:
    """By bisection: the gain at which the margin says unstable."""
    low, high = 10.0, 2000.0
    while high - low > 0.1:
        middle = 0.5 * (low + high)
        found = coupled_sensitivity_peak(contour(middle, ki_share_1_s * middle), *laws, *plants(*MASSES_KG))
        low, high = (low, middle) if math.isinf(found) else (middle, high)
    return low


def swing_m(laws: tuple[AxisParams, AxisParams], law: Params, angle_rad: float) -> float:
    """Largest error in the second of 2 s on a line with a disturbed start, the laws on rigid masses."""
    periods, velocity = 2000, Pair(1e-3 * math.cos(angle_rad), 1e-3 * math.sin(angle_rad))
    plain = [own._replace(feedforward=own.feedforward._replace(velocity=0.0)) for own in laws]
    states, coupling, errors = [initial_state(0.0) for _ in laws], at_rest(), []
    position, speed, force = np.array([1e-6, -1e-6]), np.zeros(2), np.zeros(2)
    for _ in range(periods):
        coupling, _ = coupled(law, coupling, Pair(*(-position).tolist()), velocity, Pair(0.0, 0.0))
        following = np.zeros(2)
        for axis, offset_m_s in enumerate(coupling.offset_m_s):
            at = float(position[axis])
            sample = AxisSample(0.0, 0.0, 0.0, 0.0, at, at, math.nan, float(offset_m_s))
            states[axis], command = axis_tick(plain[axis], states[axis], sample)
            following[axis] = command.force_n
        position = position + 1e-3 * speed + 0.5e-6 * force / MASSES_KG
        speed = speed + 1e-3 * force / MASSES_KG
        force = following  # a command acts after one period
        errors.append(np.abs(position).max())
    return float(max(errors[periods // 2 :]))


@pytest.mark.parametrize("ki_share_1_s", [0.0, 20.0])
def test_the_compiled_laws_swing_up_beyond_the_border_and_settle_before_it(
    laws: tuple[AxisParams, AxisParams], ki_share_1_s: float
) -> None:
    border = border_1_s(laws, ki_share_1_s)
    grown, settled = 1.02 * border, 0.98 * border
    for gain, check in ((grown, max), (settled, max)):
        law = contour(gain, ki_share_1_s * gain)
        found = check(swing_m(laws, law, angle) for angle in (0.0, 0.5, 1.0, 0.5 * math.pi))
        assert (found > 1e-5) is (gain is grown)
