"""Axes side by side in the twin: the bits of each by itself, and what the coupling does on a circle."""

from pathlib import Path

import numpy as np
import pytest

from hil_sim.config import load_plant
from kernels.arrays import Array
from servo_ctrl.config.contour_model import ContourControl
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from twin.rollout import RolloutError, rollout

MACHINE = Path(__file__).parents[3] / "machines" / "xy_table"
RADIUS_M, FEED_M_S, PERIOD_S = 0.005, 0.02, 1e-3


def circle() -> dict[str, Array]:
    """One turn and a half, from standstill within 0.1 s."""
    time_s = np.arange(2500) * PERIOD_S
    rate_1_s = FEED_M_S / RADIUS_M * np.minimum(1.0, time_s / 0.1)
    angle_rad = np.cumsum(rate_1_s) * PERIOD_S
    reference = {}
    for axis, position_m in (
        ("x", RADIUS_M * np.cos(angle_rad) - RADIUS_M),
        ("y", RADIUS_M * np.sin(angle_rad)),
    ):
        velocity_m_s = np.gradient(position_m, PERIOD_S)
        acceleration_m_s2 = np.gradient(velocity_m_s, PERIOD_S)
        reference[axis] = np.stack(
            [position_m, velocity_m_s, acceleration_m_s2, np.zeros_like(position_m)], axis=-1
        )
    return reference


def with_gain(kp_1_s: float) -> MachineConfig:
    section = ContourControl(axes=["x", "y"], kp_1_s=kp_1_s)
    return load_machine(MACHINE).model_copy(update={"contour_control": section})


def columns(machine: MachineConfig) -> dict[str, Array]:
    params = {name: axis_params(machine, name) for name in machine.axes}
    return rollout(machine, load_plant(MACHINE), params, circle(), off_cycles=5)


def test_with_gain_0_the_axes_move_to_the_bit_as_each_by_itself() -> None:
    alone, together = columns(load_machine(MACHINE)), columns(with_gain(0.0))
    assert np.nanmax(together["y.scale_position_m"]) > 0.99 * RADIUS_M
    assert list(alone) == list(together)
    for name in alone:
        assert alone[name].tobytes() == together[name].tobytes(), name


def test_the_coupling_holds_the_table_nearer_to_the_circle() -> None:
    def deviation_m(found: dict[str, Array]) -> float:
        x_m, y_m = found["x.scale_position_m"] + RADIUS_M, found["y.scale_position_m"]
        return float(np.sqrt(np.mean((np.hypot(x_m, y_m) - RADIUS_M)[200:] ** 2)))

    assert deviation_m(columns(with_gain(50.0))) < 0.75 * deviation_m(columns(load_machine(MACHINE)))


def test_what_supervision_finds_of_either_axis_ends_the_rollout() -> None:
    machine = with_gain(10.0)
    params = {name: axis_params(machine, name) for name in machine.axes}
    params["y"] = params["y"]._replace(limits=params["y"].limits._replace(following_error_m=1e-7))
    with pytest.raises(RolloutError, match=r"axis y: .* a run on the bus would stop"):
        rollout(machine, load_plant(MACHINE), params, circle(), off_cycles=5)
