"""The margin of two coupled axes: one axis as the special case, and the compiled laws at the border."""

import math
from pathlib import Path

import numpy as np
import pytest

from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.control.contour_control import Pair, Params, at_rest, coupled
from servo_ctrl.control.contour_margin import coupled_sensitivity_peak
from servo_ctrl.control.loop_margins import sensitivity_peak
from servo_ctrl.control.tick import AxisParams, axis_tick, initial_state
from servo_ctrl.control.types import AxisSample

MASSES_KG = 70.0, 89.6


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
    peak = coupled_sensitivity_peak(contour(kp_1_s), one, one, MASSES_KG[0], MASSES_KG[0])
    assert peak == pytest.approx(sensitivity_peak(faster, MASSES_KG[0]), rel=1e-9)


def test_without_a_gain_it_is_that_of_the_worse_axis(laws: tuple[AxisParams, AxisParams]) -> None:
    alone = [sensitivity_peak(law, mass_kg) for law, mass_kg in zip(laws, MASSES_KG, strict=True)]
    assert coupled_sensitivity_peak(contour(0.0), *laws, *MASSES_KG) == pytest.approx(max(alone), rel=1e-9)


def border_1_s(laws: tuple[AxisParams, AxisParams], ki_share_1_s: float) -> float:
    """By bisection: the gain at which the margin says unstable."""
    low, high = 10.0, 2000.0
    while high - low > 0.1:
        middle = 0.5 * (low + high)
        found = coupled_sensitivity_peak(contour(middle, ki_share_1_s * middle), *laws, *MASSES_KG)
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
