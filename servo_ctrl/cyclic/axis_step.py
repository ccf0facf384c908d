"""One cycle of the axes, compiled: inputs -> coupling -> sequence -> law, supervision -> set points, row.

The daemon calls `step_axes`, the whole of it over the bytes of the bus. The batch twin, which has no bytes,
calls `step_axis` in its own compiled loop.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array, Index
from kernels.jit import kernel
from kernels.record_layout import Pool
from kernels.records import read, write
from servo_ctrl.control.axis_record import tick_axis
from servo_ctrl.control.compensation.learned_waveform import State as WaveformState
from servo_ctrl.control.compensation.learned_waveform import powered_again
from servo_ctrl.control.set_point_counts import SetPointCounts
from servo_ctrl.control.tick import at_rest
from servo_ctrl.control.types import Status
from servo_ctrl.cyclic.axis_supervision import (
    BAD_COMMAND,
    FOLLOWING_ERROR,
    begin_watch,
    check_travel,
    judge,
    supervise_braking,
)
from servo_ctrl.cyclic.contour_coupling import couple_axes
from servo_ctrl.cyclic.drive_phases import Phase
from servo_ctrl.cyclic.pdo_bytes import Bytes, encode, take_inputs
from servo_ctrl.cyclic.sequence import advance
from servo_ctrl.cyclic.sequence_state import Route, Sequence

MACHINE_COLUMNS = 3
"""Of a row before its axes: time, cycle, segment."""
AXIS_COLUMNS = 12
"""Of each axis, in the order of `recording.channels.AxisRow`, which a test holds against `write_row`."""
REFERENCE_COLUMNS = 4
"""Of each axis: position, velocity, acceleration, force offset."""


_SETTLING, _SERVO, _HOMING = int(Phase.SETTLING), int(Phase.SERVO), int(Phase.HOMING)
_QUICK_STOPPING, _TAKING_OVER = int(Phase.QUICK_STOPPING), int(Phase.TAKING_OVER)
_STATUS_FOLLOWING_ERROR, _STATUS_BAD_COMMAND = int(Status.FOLLOWING_ERROR), int(Status.BAD_COMMAND)


@kernel
def step_axes(
    axes: Any,
    contours: Any,
    tables: Pool,
    kept: Array,
    axis_of: Index,
    outputs: Index,
    inputs: Bytes,
    came: NDArray[np.bool_],
    reference: Array,
    led: bool,
    time_s: float,
    cycle: int,
    segment: int,
    row: Array,
    payloads: Bytes,
) -> bool:
    """Advance all axes by one cycle; return whether one has found something.

    `contours` (pairs,): see `contour_coupling`; `axis_of` (RPDOs,): whose RPDO each is; `outputs` (RPDOs,
    objects, 2): see `encode`; `inputs` (TPDOs, 8): data of what comes with every SYNC, where it `came`
    (TPDOs,); `reference` (axes * 4,): where the axes are led, or unless `led` each stays where it was taken
    over. Makes `row` and `payloads` (RPDOs, 8).
    """
    row[0], row[1], row[2] = time_s, cycle, segment
    found = False
    for index in range(len(axes)):
        axes[index]["complete"] = take_inputs(axes[index], inputs, came)
    couple_axes(contours, axes, reference, REFERENCE_COLUMNS, led)
    for index in range(len(axes)):
        axis = axes[index]
        complete = axis["complete"]
        first = index * REFERENCE_COLUMNS
        at = MACHINE_COLUMNS + index * AXIS_COLUMNS
        own = row[at : at + AXIS_COLUMNS]
        step_axis(axis, tables, kept[index], complete, reference[first : first + REFERENCE_COLUMNS], led, own)
        found |= axis["found"] != 0 or axis["problem"] != 0
    for rpdo in range(len(outputs)):
        encode(axes[axis_of[rpdo]], outputs[rpdo], payloads[rpdo])
    return found


@kernel
def step_axis(
    axis: Any, tables: Pool, kept: Array, complete: bool, reference: Array, led: bool, row: Array
) -> None:
    """Advance an axis by one cycle, given its `inputs`; see `step_axes`."""
    inputs, law = axis["inputs"], axis["law"]
    sequence = read(axis["sequence"], Sequence)
    step_m = abs(inputs["motor_m"] - inputs["previous_motor_m"])
    at_standstill = axis["power_allowed"] and step_m <= axis["bounds"]["standstill_step_m"]
    age = 0 if sequence.phase == _SERVO else axis["input_age"]
    route, mode_shown = read(axis["route"], Route), inputs["mode_shown"]
    step = advance(route, sequence, inputs["statusword"], complete, age, at_standstill, mode_shown)
    if sequence.phase == _HOMING and step.sequence.phase in (_SETTLING, _TAKING_OVER):
        axis["homed"] = True
        axis["last_m"] = math.nan  # homing has moved the axis, and its coordinates
    write(axis["sequence"], step.sequence)
    axis["controlword"], axis["sent_mode"] = step.controlword, step.sent_mode
    axis["problem"], axis["found"] = step.problem, 0
    engaged = step.sequence.phase in (_SETTLING, _SERVO)
    if engaged and not axis["engaged"]:
        take_over(axis)
    axis["engaged"] = engaged
    if engaged:
        control(axis, tables, kept, reference, led)
        write_row(axis, row)
        return
    if step.sequence.phase == _QUICK_STOPPING:
        supervise_braking(axis)
    write(law["counts"], SetPointCounts(0, 0, 0, inputs["counts"], 0))
    row[:] = math.nan
    row[2], row[3], row[6] = inputs["motor_m"], inputs["scale_m"], inputs["current_a"]
    row[11] = inputs["statusword"]


@kernel
def take_over(axis: Any) -> None:
    """Lead the axis where it is, the law at rest; the scale reads there what the motor encoder reads.

    Only what presliding remembers of the motion before is kept.
    """
    inputs, law_state = axis["inputs"], axis["law"]["state"]
    moved_m = inputs["motor_m"] - axis["last_m"]
    axis["hold_m"] = axis["last_m"] = inputs["motor_m"]
    axis["periods_without_input"] = 0
    inputs["scale_offset_m"] = inputs["motor_m"] - inputs["scale_raw_m"]
    if not math.isnan(inputs["scale_raw_m"]):
        inputs["scale_m"] = inputs["motor_m"]
    waveform = powered_again(read(law_state["waveform"], WaveformState), moved_m, inputs["motor_m"])
    write(law_state, at_rest(inputs["motor_m"]))
    write(law_state["waveform"], waveform)
    axis["correction_m"] = 0.0
    begin_watch(axis, inputs["motor_m"])


@kernel
def control(axis: Any, tables: Pool, kept: Array, reference: Array, led: bool) -> None:
    """One tick of an axis that we lead, and what it shows."""
    inputs, law, sample = axis["inputs"], axis["law"], axis["law"]["sample"]
    motor_m = inputs["motor_m"]
    if math.isnan(motor_m):
        axis["periods_without_input"] += 1
    else:
        if axis["periods_without_input"]:
            bridge_gap(axis, motor_m)
        axis["last_m"] = motor_m
        check_travel(axis, motor_m - axis["correction_m"])
    if led:
        sample["position_command_m"], sample["velocity_command_m_s"] = reference[0], reference[1]
        sample["acceleration_command_m_s2"], sample["force_offset_n"] = reference[2], reference[3]
    else:
        sample["position_command_m"], sample["velocity_command_m_s"] = axis["hold_m"], 0.0
        sample["acceleration_command_m_s2"], sample["force_offset_n"] = 0.0, 0.0
    sample["motor_position_m"], sample["scale_position_m"] = motor_m, inputs["scale_m"]
    sample["motor_force_n"] = inputs["current_a"] * axis["wiring"]["newton_per_ampere"]
    law["current_a"] = inputs["current_a"]
    tick_axis(law, tables)
    axis["correction_m"] = law["command"]["correction_m"]
    if law["command"]["status"]:
        if law["command"]["status"] & _STATUS_FOLLOWING_ERROR:
            axis["found"] |= FOLLOWING_ERROR
        if law["command"]["status"] & _STATUS_BAD_COMMAND:
            axis["found"] |= BAD_COMMAND
    else:
        judge(axis, kept)


@kernel
def bridge_gap(axis: Any, motor_m: float) -> None:
    """Put the mean velocity over periods without a motor position into the velocity estimate.

    Extrapolation to where the motor was a period ago would be off by a T^2 n^2 / 2 after n of them, and
    the velocity loop would take that, over one period, for a velocity. The observer leaves the gap out.
    """
    step_m = (motor_m - axis["last_m"]) / (axis["periods_without_input"] + 1)
    state = axis["law"]["state"]
    state["velocity_loop"]["position_1_m"] = motor_m - step_m
    state["velocity_loop"]["position_2_m"] = motor_m - 2.0 * step_m
    state["observer"]["velocity_m_s"] = math.nan
    state["position_loop"]["error_m"] = math.nan
    axis["periods_without_input"] = 0


@kernel
def write_row(axis: Any, row: Array) -> None:
    """Make the row of an axis that we lead."""
    sample, command = axis["law"]["sample"], axis["law"]["command"]
    row[0], row[1] = command["position_m"], sample["velocity_command_m_s"]
    row[2], row[3] = sample["motor_position_m"], sample["scale_position_m"]
    row[4], row[5], row[6] = command["motor_velocity_m_s"], command["force_n"], axis["law"]["current_a"]
    row[7], row[8] = command["position_error_m"], command["pulse_m_s"]
    row[9], row[10], row[11] = command["disturbance_n"], command["correction_m"], axis["inputs"]["statusword"]
