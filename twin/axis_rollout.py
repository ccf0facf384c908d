"""One axis in the batch twin: control law and plant in one compiled loop, with the cycle of the bus.

At SYNC k the plant advances one period under the active set points; the set points buffered since SYNC k - 1
take effect; positions are latched in counts; the controller ticks; its set points, in per mille and counts,
are buffered (transmission type 1: one period of delay) or take effect at once (255).
"""

import math
from typing import Any, NamedTuple

import numpy as np

from hil_sim.config import Plant
from hil_sim.plant.integrate import advance_axis
from kernels.arrays import Array
from kernels.jit import kernel, threaded_kernel
from servo_ctrl.control.set_point_counts import SetPointCounts, SetPointUnits, set_point_counts
from servo_ctrl.control.tick import AxisParams, AxisState, at_rest, axis_tick
from servo_ctrl.control.types import AxisSample
from servo_ctrl.recording.channels import AXIS_CHANNELS
from twin.wiring import Wires

COLUMNS = tuple(channel.name for channel in AXIS_CHANNELS if channel.dtype == "float64")
"""Columns of an axis, as in a recording; the twin has no statusword."""
ROW = np.dtype([(name, np.float64) for name in COLUMNS])
Rows = np.ndarray[Any, np.dtype[np.void]]
"""(n,) of `ROW`."""


class Carried(NamedTuple):
    """State of the loop between cycles, besides the plant's state."""

    state: AxisState
    engaged: bool
    """Whether the drive is on and the axis has its zero."""
    origin: int
    """Encoder counts at that zero."""
    scale_offset_m: float
    buffered: SetPointCounts
    """Set points sent last, not active yet."""


class AxisRollout:
    """Simulates one axis piece by piece, each from the end of the previous one; advances `plant` in place.

    Raises:
        ValueError: the axis depends on another one, but here each axis runs alone.

    """

    def __init__(
        self, params: AxisParams, wires: Wires, plant: Plant, index: int, substeps: int, dt_s: float
    ) -> None:
        if plant.params[index]["cross_axis_coupling"]["enabled"]:
            raise ValueError("cross_axis_coupling: in the batch twin each axis runs by itself, use the bus")
        self._params = params
        records = plant.params[index], plant.state[index], plant.setpoint[index]
        self._constant = (wires, *records, substeps, dt_s)
        self._carried = Carried(at_rest(0.0), False, 0, 0.0, SetPointCounts(0, 0, 0, 0, 0))

    def change_params(self, params: AxisParams) -> None:
        """Change the parameters from the next cycle on."""
        self._params = params

    def rows(self, reference: Array, off_cycles: int = 0) -> Rows:
        """Return rows (n,) for the next commands (n, 4); the first `off_cycles` are without power."""
        rows = np.full((len(reference), len(COLUMNS)), np.nan).view(ROW)[:, 0]
        commands = np.ascontiguousarray(reference, dtype=np.float64)
        self._carried = _run_axis(self._params, *self._constant, commands, off_cycles, self._carried, rows)
        return rows


@kernel
def _take_effect(output: int, wires: Wires, sp: Any, origin: int, sent: SetPointCounts) -> None:
    """Write set points of the bus into the plant's record, like the drive's cyclic modes."""
    sp.loop = output + 1
    if output == 0:
        total = min(max(sent.torque + sent.torque_offset, -wires.max_torque), wires.max_torque)
        sp.current_a = total * wires.drive_ampere_per_torque
        sp.current_offset_a = 0.0
        return
    sp.current_offset_a = sent.torque_offset * wires.drive_ampere_per_torque
    if output == 1:
        sp.velocity_m_s = sent.velocity * wires.drive_metre_per_s_per_unit
        sp.velocity_offset_m_s = 0.0
    else:
        sp.position_m = (sent.position + origin) * wires.drive_metre_per_count
        sp.velocity_offset_m_s = sent.velocity_offset * wires.drive_metre_per_s_per_unit


@threaded_kernel  # several axes, machines or variants run at once in threads
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
    carried: Carried,
    rows: Any,
) -> Carried:
    state, engaged, origin, scale_offset_m, buffered = carried
    units = SetPointUnits(
        wires.newton_per_permille,
        wires.metre_per_count,
        wires.metre_per_s_per_unit,
        wires.torque_offset_mapped,  # an offset without its own object is part of the set point
        wires.velocity_offset_mapped,
    )
    for k in range(len(reference)):
        row = rows[k]
        advance_axis(p, s, sp, substeps, dt_s)
        if engaged and not wires.immediate:
            _take_effect(params.output, wires, sp, origin, buffered)
        taken_over = not engaged and k >= off_cycles
        if taken_over:
            origin = s.encoder_counts
        motor_m = (s.encoder_counts - origin) * wires.metre_per_count
        scale_m = math.nan
        if taken_over:
            engaged = True
            scale_offset_m = motor_m - s.scale_counts * wires.scale_metre_per_count
            state = at_rest(motor_m)
        if p.scale.enabled:
            scale_m = s.scale_counts * wires.scale_metre_per_count + scale_offset_m
        row.motor_position_m = motor_m
        row.motor_current_a = (
            np.rint(s.current_measured_a * wires.drive_permille_per_ampere) * wires.ampere_per_permille
        )
        if not engaged:
            continue
        row.scale_position_m = scale_m
        sample = AxisSample(
            position_command_m=reference[k, 0],
            velocity_command_m_s=reference[k, 1],
            acceleration_command_m_s2=reference[k, 2],
            force_offset_n=reference[k, 3],
            motor_position_m=motor_m,
            scale_position_m=scale_m,
            motor_force_n=row.motor_current_a * wires.newton_per_ampere,
        )
        state, command = axis_tick(params, state, sample)
        row.position_command_m = command.position_m
        row.velocity_command_m_s = reference[k, 1]
        row.motor_velocity_m_s = command.motor_velocity_m_s
        row.force_command_n = command.force_n
        row.position_error_m = command.position_error_m
        row.pulse_m_s = command.pulse_m_s
        row.disturbance_n = command.disturbance_n
        row.correction_m = command.correction_m
        buffered = set_point_counts(units, params.feedforward.velocity, command, reference[k, 1])
        if wires.immediate:
            _take_effect(params.output, wires, sp, origin, buffered)
    return Carried(state, engaged, origin, scale_offset_m, buffered)
