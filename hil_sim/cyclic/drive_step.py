"""The tick of drives in a cyclic mode: set points before the plant moves, readings after it.

`axes` (n,) are `DriveRecord`s, `objects` (n,) the process objects of each drive as records of float64 (every
one is a whole number far below 2^53), `setpoints` and `state` (n,) the plant's. Python calls parts of it for
one drive, with the arrays and an `index`: passing a record would take ten times as long.
"""

import math
from typing import Any

from hil_sim.cyclic.drive_limits import clip_position, clip_step, clip_torque, clip_velocity
from hil_sim.cyclic.drive_readings import check_following, inputs_of, read_axis, wrapped
from hil_sim.plant.amplifier import CURRENT, POSITION, VELOCITY
from kernels.arrays import Index
from kernels.jit import kernel

CYCLIC_POSITION, CYCLIC_VELOCITY, CYCLIC_TORQUE = 8, 9, 10
"""Modes of operation 6060h."""
SWITCHED, FOLLOWING_ERROR, NOT_FINITE = 1, 2, 4
"""Findings of a tick: inputs have changed, the following error is a fault, the plant is not finite."""


@kernel
def command_axes(axes: Any, objects: Any, setpoints: Any, dt_s: float, share: float) -> None:
    """Command all axes in cyclic modes for the next `dt_s`, a `share` of the communication cycle."""
    for index in range(len(axes)):
        if axes[index]["cyclic_mode"]:
            command_cyclic_axis(axes, objects, setpoints, index, dt_s, share)


@kernel
def command_cyclic_axis(
    axes: Any, objects: Any, setpoints: Any, index: int, dt_s: float, share: float
) -> None:
    """Command the set point and offsets of CST, CSV or CSP, within the limits."""
    axis, own = axes[index], objects[index]
    if axis["cyclic_mode"] == CYCLIC_TORQUE:
        largest = own["max_torque"]
        torque = max(-largest, min(largest, own["target_torque"] + own["torque_offset"]))
        torque = clip_torque(axes, objects, index, torque)
        own["torque_demand"] = torque
        command_torque(axes, setpoints, index, torque)
    elif axis["cyclic_mode"] == CYCLIC_VELOCITY:
        wanted = own["target_velocity"] + own["velocity_offset"]
        wanted = clip_velocity(axes, objects, index, wanted, own["quick_stop_deceleration"], dt_s)
        velocity = interpolate(axis, wanted, share)
        own["velocity_demand_value"] = round(velocity)
        command_velocity(axes, setpoints, index, velocity, own["torque_offset"])
    else:
        before, span = axis["present"], axis["range_span"]
        wanted = nearest_equivalent(span, own["target_position"] + own["position_offset"], before)
        position = interpolate(axis, clip_position(axes, objects, index, wanted), share)
        slower = clip_step(axes, index, before, position, dt_s)
        if slower != position:
            position = axis["present"] = axis["start"] = axis["target"] = slower
            axis["progress"] = 1.0
        store_demand(axes, objects, index, position, (position - before) / dt_s)
        offsets = own["velocity_offset"], own["torque_offset"]
        command_position(axes, setpoints, index, position, offsets[0], offsets[1])


@kernel
def interpolate(axis: Any, target: float, share: float) -> float:
    """Advance by a `share` of the cycle towards `target`, reached linearly within one communication cycle.

    It runs by time, not by SYNC: in real time an advance is a little longer or shorter than a cycle.
    """
    if target != axis["target"]:
        axis["start"], axis["target"], axis["progress"] = axis["present"], target, 0.0
    if axis["progress"] < 1.0:
        axis["progress"] += share
        whole = axis["progress"] >= 1.0
        axis["present"] = target if whole else axis["start"] + (target - axis["start"]) * axis["progress"]
    return float(axis["present"])


@kernel
def store_demand(axes: Any, objects: Any, index: int, position: float, velocity: float) -> None:
    """Store the demand of the position loop: user counts; counts/s in the direction of the position."""
    axis, own = axes[index], objects[index]
    demand = round(position)
    own["position_demand_internal_value"] = demand
    own["position_demand_value"] = wrapped(axis["range_low"], axis["range_span"], demand)
    own["velocity_demand_value"] = round(axis["velocity_sign"] * axis["position_sign"] * velocity)


@kernel
def nearest_equivalent(span: int, wanted: float, here: float) -> float:
    """Return the position nearest to `here` that wraps to the same as `wanted`; of two, the positive one."""
    if not span:
        return wanted
    return wanted - span * math.ceil((wanted - here) / span - 0.5)


@kernel
def command_torque(axes: Any, setpoints: Any, index: int, torque: float) -> None:
    """Command a torque (per mille)."""
    axis, setpoint = axes[index], setpoints[index]
    setpoint["loop"], setpoint["current_offset_a"] = CURRENT, 0.0
    setpoint["current_a"] = int(torque) * axis["torque_sign"] * axis["a_per_torque"]


@kernel
def command_velocity(axes: Any, setpoints: Any, index: int, velocity: float, torque_offset: float) -> None:
    """Command a velocity (counts/s), reached linearly over the next advance."""
    axis, setpoint = axes[index], setpoints[index]
    setpoint["loop"], setpoint["velocity_offset_m_s"] = VELOCITY, 0.0
    setpoint["current_offset_a"] = int(torque_offset) * axis["torque_sign"] * axis["a_per_torque"]
    setpoint["velocity_m_s"] = axis["velocity_sign"] * velocity * axis["m_per_count"]


@kernel
def command_position(
    axes: Any, setpoints: Any, index: int, position: float, velocity_offset: float, torque_offset: float
) -> None:
    """Command a position (user counts), reached linearly over the next advance."""
    axis, setpoint = axes[index], setpoints[index]
    setpoint["loop"] = POSITION
    offset = axis["velocity_sign"] * velocity_offset + 0.0  # no negative zero
    setpoint["velocity_offset_m_s"] = offset * axis["m_per_count"]
    setpoint["current_offset_a"] = int(torque_offset) * axis["torque_sign"] * axis["a_per_torque"]
    setpoint["position_m"] = axis["position_sign"] * (position - axis["origin"]) * axis["m_per_count"]


@kernel
def supervise_axes(
    axes: Any, objects: Any, state: Any, dt_s: float, word: int, limited_word: int, findings: Index
) -> bool:
    """Read and supervise axes in cyclic modes; write `findings` (n,) and return whether there is any.

    Sets the statusword to `word`, or to `limited_word` where a limit is active; the caller sets that of an
    axis with a finding.
    """
    any_finding = False
    for index in range(len(axes)):
        axis, own = axes[index], objects[index]
        findings[index] = finding(axes, objects, state, index, dt_s)
        if findings[index]:
            any_finding = True
            continue
        limited = axis["clipped"] or axis["blocked_low"] > -math.inf or axis["blocked_high"] < math.inf
        own["statusword"] = limited_word if limited else word
        axis["clipped"] = False
    return any_finding


@kernel
def finding(axes: Any, objects: Any, states: Any, index: int, dt_s: float) -> int:
    """Read an axis; return a finding that the caller must handle, or 0."""
    if not read_axis(axes, objects, states, index):
        return NOT_FINITE
    if inputs_of(axes, states, index) != objects[index]["digital_inputs"]:
        return SWITCHED
    if axes[index]["cyclic_mode"] == CYCLIC_POSITION and check_following(axes, objects, index, dt_s):
        return FOLLOWING_ERROR
    return 0
