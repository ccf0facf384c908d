"""The compiled twin against the same cycle in Python with the parts of the two processes."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from hil_sim.config import build_plant, load_plant
from hil_sim.physics.sensor import cross_axis_coupling
from hil_sim.plant.integrate import advance
from servo_ctrl.canopen.scaling import drive_scaling, scale_metre_per_count, to_integer
from servo_ctrl.canopen.settings import force_limit_permille
from servo_ctrl.config.kernel_params import axis_params, with_observer, with_pulse, with_screw
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.compensation import fuzzy_pd, sampled_dual_loop
from servo_ctrl.control.compensation.fuzzy_inference import surface
from servo_ctrl.control.tick import AxisParams, axis_tick, initial_state
from servo_ctrl.control.types import AxisSample
from twin.axis_rollout import COLUMNS
from twin.rollout import rollout

MACHINE = Path(__file__).parents[3] / "machines" / "xy_table"
OFF_CYCLES = 7
CYCLES = 400
# more than a frame holds: with every object mapped, every path of the twin is taken
EVERY_SETPOINT = [
    "controlword",
    "target_torque",
    "torque_offset",
    "target_velocity",
    "target_position",
    "velocity_offset",
]

LEARNED = np.array(
    [[0.1, 1.0, 2.0], [0.05, 0.03, 0.02], [2e-4, 5e-4, 1e-3], [0.03] * 3, [0.03] * 3, [-3e-4] * 3]
)

SCREW = np.array([[-1e-2, 0.0, 1e-2], [-5e-6, 0.0, 8e-6]])


def params_of(machine: MachineConfig, axis: str) -> AxisParams:
    """The axis with everything switched on that the control law has."""
    params = with_screw(axis_params(machine, axis), SCREW, lost_motion_m=4e-6)
    params = params._replace(
        position_loop=params.position_loop._replace(
            ki_1_s2=100.0, kd=0.05, derivative_blend=0.3, scale_feedback=False
        ),
        fuzzy=fuzzy_pd.Params(True, 2e-6, 2e-4, 1e4, 1e4, 20.0, 4e-3, 200.0, surface(13)),
        sampled=sampled_dual_loop.Params(True, 0.01, 1e-7, 3, 1e-5, True, 5.0, 500.0, 1.0),
    )
    return with_observer(with_pulse(params, LEARNED), enabled=True)


def command() -> NDArray[np.float64]:
    t = np.arange(CYCLES) * 1e-3
    w = 2.0 * np.pi * 4.0
    swell = np.minimum(1.0, t / 0.1)
    position = 2e-3 * swell * (1.0 - np.cos(w * np.minimum(t, 0.36)))  # the last cycles at rest
    velocity = np.gradient(position, 1e-3)
    return np.stack([position, velocity, np.gradient(velocity, 1e-3), 5.0 * np.sin(40.0 * t)], axis=-1)


def machine_with(mode: str, transmission_type: int) -> Any:
    machine = load_machine(MACHINE)
    axes = {
        name: axis.model_copy(
            update={
                "mode": mode,
                "limits": axis.limits.model_copy(update={"following_error_mm": 10.0}),  # a rough motion
                "drive": axis.drive.model_copy(
                    update={"rpdo_transmission_type": transmission_type, "rpdo1": EVERY_SETPOINT}
                ),
            }
        )
        for name, axis in machine.axes.items()
    }
    return machine.model_copy(update={"axes": axes})


def written_out(machine: Any, mode: str, delayed: bool) -> dict[str, list[float]]:
    """One axis, one cycle after the other, rounding with the controller's `to_integer`."""
    plant_config = load_plant(MACHINE)
    plant, axis = build_plant(plant_config), plant_config.axes["x"]
    params, unit = params_of(machine, "x"), drive_scaling(machine.axes["x"])
    rated_nm = axis.motor.rated_torque_mnm * 1e-3
    ampere_per_torque = rated_nm / 1000.0 / axis.motor.torque_constant_nm_a
    per_ampere = 1000.0 / (axis.motor.rated_current_ma * 1e-3)
    count_m = axis.lead_m / axis.encoder.counts_per_rev
    state, setpoint = plant.state[0], plant.setpoint[0]
    max_torque, max_current = force_limit_permille(machine.axes["x"])
    rated_a = axis.motor.rated_current_ma * 1e-3
    setpoint["current_limit_a"] = min(max_torque * ampere_per_torque, max_current * rated_a / 1000.0)
    loop = {"cst": 1, "csv": 2, "csp": 3}[mode]
    columns: dict[str, list[float]] = {name: [] for name in COLUMNS}
    tick_state, buffered, scale_offset_m = None, None, 0.0

    def activate(values: dict[str, float]) -> None:
        setpoint["loop"] = loop
        for name, value in values.items():
            setpoint[name] = value

    for k, row in enumerate(command()):
        advance(*plant, 20, plant_config.dt_s)
        if delayed and buffered is not None:
            activate(buffered)
        motor_m = int(state["encoder_counts"]) * unit.metre_per_count
        scale_raw_m = int(state["scale_counts"]) * scale_metre_per_count(machine.axes["x"])
        current_a = round(float(state["current_measured_a"]) * per_ampere) * unit.ampere_per_permille
        if k < OFF_CYCLES:
            values = [np.nan, np.nan, motor_m, *[np.nan] * 3, current_a, *[np.nan] * 4]
            for name, value in zip(COLUMNS, values, strict=True):
                columns[name].append(value)
            continue
        if tick_state is None:
            tick_state, scale_offset_m = initial_state(motor_m), motor_m - scale_raw_m
        scale_m = scale_raw_m + scale_offset_m
        force_n = current_a * unit.newton_per_ampere
        tick_state, out = axis_tick(
            params, tick_state, AxisSample(*map(float, row), motor_m, scale_m, force_n)
        )
        torque = to_integer(out.force_n, unit.newton_per_permille, -32767, 32767)
        offset = to_integer(out.force_offset_n, unit.newton_per_permille, -32767, 32767)
        feedforward = params.feedforward.velocity * row[1]
        by_mode = {
            "cst": {"current_a": (torque + offset) * ampere_per_torque},
            "csv": {
                "velocity_m_s": to_integer(out.velocity_m_s, count_m, -(2**31), 2**31) * count_m,
                "current_offset_a": offset * ampere_per_torque,
            },
            "csp": {
                "position_m": to_integer(out.position_m + out.correction_m, count_m, -(2**31), 2**31)
                * count_m,
                "velocity_offset_m_s": to_integer(feedforward, count_m, -(2**31), 2**31) * count_m,
                "current_offset_a": offset * ampere_per_torque,
            },
        }
        buffered = by_mode[mode]
        if not delayed:
            activate(buffered)
        values = [
            out.position_m,
            row[1],
            motor_m,
            scale_m,
            out.motor_velocity_m_s,
            out.force_n,
            current_a,
            out.position_error_m,
            out.pulse_m_s,
            out.disturbance_n,
            out.correction_m,
        ]
        for name, value in zip(COLUMNS, values, strict=True):
            columns[name].append(value)
    return columns


@pytest.mark.parametrize("mode", ["cst", "csv", "csp"])
@pytest.mark.parametrize("transmission_type", [1, 255])
def test_twin_gives_the_bits_of_the_written_out_cycle(mode: str, transmission_type: int) -> None:
    machine = machine_with(mode, transmission_type)
    params = {name: params_of(machine, name) for name in machine.axes}
    reference = dict.fromkeys(machine.axes, command())
    twin = rollout(machine, load_plant(MACHINE), params, reference, off_cycles=OFF_CYCLES)
    truth = written_out(machine, mode, transmission_type == 1)
    assert np.ptp(twin["x.motor_position_m"]) > 3e-3
    assert np.nanmax(np.abs(twin["x.pulse_m_s"])) > 3e-4
    assert np.nanmax(np.abs(twin["x.disturbance_n"])) > 1.0
    assert np.nanmax(np.abs(np.diff(twin["x.correction_m"][-32:]))) > 0.0  # the sampled dual loop too
    for name in COLUMNS:
        assert np.array_equal(twin[f"x.{name}"], np.array(truth[name]), equal_nan=True), name


def test_columns_are_named_as_in_a_recording() -> None:
    machine = load_machine(MACHINE)
    params = {name: axis_params(machine, name) for name in machine.axes}
    twin = rollout(machine, load_plant(MACHINE), params, dict.fromkeys(machine.axes, command()))
    assert set(twin) == {"time_s"} | {f"{axis}.{name}" for axis in "xy" for name in COLUMNS}
    assert all(len(column) == CYCLES for column in twin.values())
    assert twin["time_s"][-1] == pytest.approx((CYCLES - 1) * 1e-3)


def test_same_rollout_twice_gives_the_same_bits() -> None:
    machine = load_machine(MACHINE)
    params = {name: axis_params(machine, name) for name in machine.axes}
    arguments = (machine, load_plant(MACHINE), params, dict.fromkeys(machine.axes, command()))
    first, second = rollout(*arguments), rollout(*arguments)
    assert all(np.array_equal(first[name], second[name], equal_nan=True) for name in first)


def test_axes_that_do_not_match_are_refused() -> None:
    machine = load_machine(MACHINE)
    params = {"x": axis_params(machine, "x")}
    with pytest.raises(ValueError, match="axis y"):
        rollout(machine, load_plant(MACHINE), params, {"x": command()})


def test_the_twin_refuses_coupled_axes_with_a_reason() -> None:
    machine, plant = load_machine(MACHINE), load_plant(MACHINE)
    effects = plant.axes["y"].effects | {"cross_axis_coupling": cross_axis_coupling.Params(0.0, 50e-6)}
    axes = plant.axes | {"y": plant.axes["y"].model_copy(update={"effects": effects})}
    with pytest.raises(ValueError, match="cross_axis_coupling: the batch twin simulates each axis alone"):
        rollout(
            machine,
            plant.model_copy(update={"axes": axes}),
            {axis: axis_params(machine, axis) for axis in axes},
            {axis: np.zeros((2, 4)) for axis in axes},
        )
