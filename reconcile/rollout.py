"""The batch twin: the daemon's control law and the simulator's plant in one compiled loop, without a bus.

The order of operations and every rounding to integers are those of the two processes on the bus, so that a
rollout gives the same bits as a recording:

    SYNC k: the plant advances one period under the set points in force; those buffered since SYNC k - 1
    take effect; positions are latched in counts; the controller ticks; its set points go out in per mille
    and counts and are buffered (transmission type 1: one period of delay) or take effect at once (255).

Axes do not act on one another yet, so each runs its whole program by itself.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numba
import numpy as np

from hil_sim.config import build_plant
from hil_sim.plant.integrate import advance_axis
from reconcile.wiring import Wires, wires_of
from servo_ctrl.control.tick import axis_tick
from servo_ctrl.control.types import (
    AxisSample,
    AxisState,
    ObserverState,
    OffsetMotion,
    PositionState,
    PulseShape,
    PulseState,
    SampledState,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hil_sim.config import Plant, PlantConfig
    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.control.params import AxisParams

    Array = NDArray[np.float64]

COLUMNS = (
    "position_command_m",
    "velocity_command_m_s",
    "motor_position_m",
    "scale_position_m",
    "motor_velocity_m_s",
    "force_command_n",
    "motor_current_a",
    "position_error_m",
    "pulse_m_s",
    "disturbance_n",
    "correction_m",
)
"""Per axis, named and filled as in a recording."""

_I16_MAX = 0x7FFF
_I32_MAX = 0x7FFFFFFF


def rollout(
    machine: MachineConfig,
    plant_config: PlantConfig,
    params: dict[str, AxisParams],
    reference: dict[str, Array],
    *,
    off_cycles: int = 0,
) -> dict[str, Array]:
    """Columns of a recording (n,) for the commands `reference[axis]`, (n, 4) at the SYNC period.

    `reference`: position m, velocity m/s, acceleration m/s^2, force offset N. For the first `off_cycles` of
    the n the drives have no power; then each axis takes where it stands as its zero (homing method 37).

    Raises:
        ValueError: the period is no whole number of substeps, or the axes differ.

    """
    substeps = substeps_of(machine, plant_config)
    plant = build_plant(plant_config)
    columns: dict[str, Array] = {}
    length = 0
    for index, (name, axis_plant) in enumerate(plant_config.axes.items()):
        if name not in reference or name not in machine.axes or name not in params:
            raise ValueError(f"axis {name} is in the plant but not in the controller's machine or reference")
        wires = wires_of(machine.axes[name], axis_plant)
        plant.setpoint[index]["current_limit_a"] = wires.current_limit_a
        rows = rollout_axis(
            params[name], wires, plant, index, substeps, plant_config.dt_s, reference[name], off_cycles
        )
        columns.update({f"{name}.{column}": rows[:, i] for i, column in enumerate(COLUMNS)})
        length = len(rows)
    return {"time_s": np.arange(length, dtype=np.float64) * machine.period_s, **columns}


def substeps_of(machine: MachineConfig, plant_config: PlantConfig) -> int:
    """Substeps of the plant in one SYNC period.

    Raises:
        ValueError: not a whole number.

    """
    substeps = round(machine.bus.sync_period_us / plant_config.substep_us)
    if substeps < 1 or not math.isclose(substeps * plant_config.substep_us, machine.bus.sync_period_us):
        raise ValueError("bus.sync_period_us is not a whole number of plant.substep_us")
    return substeps


def rollout_axis(
    params: AxisParams,
    wires: Wires,
    plant: Plant,
    index: int,
    substeps: int,
    dt_s: float,
    reference: Array,
    off_cycles: int,
) -> Array:
    """Rows (n, len(COLUMNS)) of one axis; `plant` is advanced in place."""
    rows = np.full((len(reference), len(COLUMNS)), np.nan)
    _run_axis(
        params,
        wires,
        plant.params[index],
        plant.state[index],
        plant.setpoint[index],
        substeps,
        dt_s,
        np.ascontiguousarray(reference, dtype=np.float64),
        off_cycles,
        rows,
    )
    return rows


@numba.njit(error_model="numpy")  # not cached on disk: numba would not see a change in either side's kernels
def _integer(value: float, unit: float, largest: int) -> int:
    """`servo_ctrl.canopen.scaling.to_integer`, half to even."""
    return int(min(max(np.rint(value / unit), -largest), largest))


@numba.njit(error_model="numpy")
def _take_effect(
    output: int,
    wires: Wires,
    sp: Any,
    origin: int,
    torque: int,
    torque_offset: int,
    velocity: int,
    position: int,
    velocity_offset: int,
) -> None:
    """Set points of the bus into the plant's record, as the drive's cyclic modes put them there."""
    sp.loop = output + 1
    if output == 0:
        total = min(max(torque + torque_offset, -wires.max_torque), wires.max_torque)
        sp.current_a = total * wires.drive_ampere_per_torque
        sp.current_offset_a = 0.0
        return
    sp.current_offset_a = torque_offset * wires.drive_ampere_per_torque
    if output == 1:
        sp.velocity_m_s = velocity * wires.drive_metre_per_count
        sp.velocity_offset_m_s = 0.0
    else:
        sp.position_m = (position + origin) * wires.drive_metre_per_count
        sp.velocity_offset_m_s = velocity_offset * wires.drive_metre_per_count


@numba.njit(error_model="numpy")
def _axis_state(motor_m: float) -> AxisState:
    """`initial_state`, in a batch."""
    resting = OffsetMotion(0.0, 0.0, 0.0, 0.0, True)
    return AxisState(
        motor_m,
        motor_m,
        0.0,
        0.0,
        0.0,
        0.0,
        PositionState(0.0, 0.0, 0.0),
        PulseState(motor_m, 0.0, 0.0, PulseShape(0.0, 0.0, 0.0, 0.0, 0.0)),
        ObserverState(0.0, 0.0, math.nan),
        resting,
        SampledState(0.0, 0, resting),
    )


@numba.njit(error_model="numpy")
def _run_axis(
    params: AxisParams,
    wires: Wires,
    p: Any,
    s: Any,
    sp: Any,
    substeps: int,
    dt_s: float,
    reference: Array,
    off_cycles: int,
    rows: Array,
) -> None:
    state = _axis_state(0.0)
    engaged = False
    torque = 0
    position = 0
    velocity = 0
    velocity_offset = 0
    torque_offset = 0
    origin = 0
    scale_offset_m = 0.0
    for k in range(len(reference)):
        advance_axis(p, s, sp, substeps, dt_s)
        if engaged and not wires.immediate:
            _take_effect(
                params.output, wires, sp, origin, torque, torque_offset, velocity, position, velocity_offset
            )
        if not engaged and k >= off_cycles:
            origin = s.encoder_counts
        motor_m = (s.encoder_counts - origin) * wires.metre_per_count
        scale_m = math.nan
        if not engaged and k >= off_cycles:
            engaged = True
            scale_offset_m = motor_m - s.scale_counts * wires.scale_metre_per_count
            state = _axis_state(motor_m)
        if p.scale.enabled:
            scale_m = s.scale_counts * wires.scale_metre_per_count + scale_offset_m
        rows[k, 2] = motor_m
        rows[k, 6] = (
            np.rint(s.current_measured_a * wires.drive_permille_per_ampere) * wires.ampere_per_permille
        )
        if not engaged:
            continue
        rows[k, 3] = scale_m
        sample = AxisSample(
            reference[k, 0],
            reference[k, 1],
            reference[k, 2],
            reference[k, 3],
            motor_m,
            scale_m,
            rows[k, 6] * wires.newton_per_ampere,
        )
        state, command = axis_tick(params, state, sample)
        rows[k, 0] = command.position_m
        rows[k, 1] = reference[k, 1]
        rows[k, 4] = command.motor_velocity_m_s
        rows[k, 5] = command.force_n
        rows[k, 7] = command.position_error_m
        rows[k, 8] = command.pulse_m_s
        rows[k, 9] = command.disturbance_n
        rows[k, 10] = command.correction_m
        force_n, offset_n = command.force_n, command.force_offset_n
        if not wires.torque_offset_mapped:  # what has no object of its own goes with the set point
            force_n, offset_n = force_n + offset_n, 0.0
        torque = _integer(force_n, wires.newton_per_permille, _I16_MAX)
        torque_offset = _integer(offset_n, wires.newton_per_permille, _I16_MAX)
        position = _integer(command.position_m + command.correction_m, wires.metre_per_count, _I32_MAX)
        velocity = _integer(command.velocity_m_s, wires.metre_per_count, _I32_MAX)
        feedforward = params.feedforward.velocity if wires.velocity_offset_mapped else 0.0
        velocity_offset = _integer(feedforward * reference[k, 1], wires.metre_per_count, _I32_MAX)
        if wires.immediate:
            _take_effect(
                params.output, wires, sp, origin, torque, torque_offset, velocity, position, velocity_offset
            )
