"""The tick of drives in a cyclic mode: set points before the plant moves, readings behind it.

`axes` (n,) are `DriveRecord`s, `objects` (n,) the process objects of each drive as records of float64 (every
one is a whole number far below 2^53), `setpoints` and `state` (n,) the plant's. Python calls parts of it for
one drive, with the arrays and an `index`: handing a record over would take ten times as long.
"""

import math
from typing import Any

from hil_sim.plant.amplifier import CURRENT, POSITION, VELOCITY
from kernels.arrays import Index
from kernels.jit import kernel

CYCLIC_POSITION, CYCLIC_VELOCITY, CYCLIC_TORQUE = 8, 9, 10
"""Modes of operation 6060h."""
NO_WINDOW = 0xFFFF_FFFF
"""Following error window 6065h that is switched off."""
NEGATIVE_SWITCH, POSITIVE_SWITCH, HOME_SWITCH = 1, 2, 4
"""Digital inputs 60FDh."""
SWITCHED, FOLLOWING_ERROR, NOT_FINITE = 1, 2, 4
"""What a tick finds: inputs have changed, the following error is a fault, the plant has no number."""


@kernel
def lead_axes(axes: Any, objects: Any, setpoints: Any, dt_s: float, share: float) -> None:
    """Command all axes that a cyclic mode leads for the next `dt_s`, a `share` of the communication cycle."""
    for index in range(len(axes)):
        if axes[index]["led"]:
            lead_axis(axes, objects, setpoints, index, dt_s, share)


@kernel
def lead_axis(axes: Any, objects: Any, setpoints: Any, index: int, dt_s: float, share: float) -> None:
    """CST, CSV or CSP: the set point and its offsets, within the limits."""
    axis, own = axes[index], objects[index]
    if axis["led"] == CYCLIC_TORQUE:
        largest = own["max_torque"]
        torque = max(-largest, min(largest, own["target_torque"] + own["torque_offset"]))
        torque = clip_torque(axes, objects, index, torque)
        own["torque_demand"] = torque
        command_torque(axes, setpoints, index, torque)
    elif axis["led"] == CYCLIC_VELOCITY:
        wanted = own["target_velocity"] + own["velocity_offset"]
        wanted = clip_velocity(axes, objects, index, wanted, own["quick_stop_deceleration"], dt_s)
        velocity = interpolate(axis, wanted, share)
        own["velocity_demand_value"] = round(velocity)
        command_velocity(axes, setpoints, index, velocity, own["torque_offset"])
    else:
        before, span = axis["present"], axis["range_span"]
        wanted = nearest(span, own["target_position"] + own["position_offset"], before)
        position = interpolate(axis, clip_position(axes, objects, index, wanted), share)
        slower = clip_step(axes, index, before, position, dt_s)
        if slower != position:
            position = axis["present"] = axis["start"] = axis["target"] = slower
            axis["progress"] = 1.0
        show_demand(axes, objects, index, position, (position - before) / dt_s)
        offsets = own["velocity_offset"], own["torque_offset"]
        command_position(axes, setpoints, index, position, offsets[0], offsets[1])


@kernel
def interpolate(axis: Any, target: float, share: float) -> float:
    """Move on by a `share` of the cycle towards `target`, reached linearly within one communication cycle.

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
def show_demand(axes: Any, objects: Any, index: int, position: float, velocity: float) -> None:
    """The demand of the position loop: user counts; counts/s in the direction of the position."""
    axis, own = axes[index], objects[index]
    demand = round(position)
    own["position_demand_internal_value"] = demand
    own["position_demand_value"] = shown(axis["range_low"], axis["range_span"], demand)
    own["velocity_demand_value"] = round(axis["velocity_sign"] * axis["position_sign"] * velocity)


@kernel
def shown(low: int, span: int, position: int) -> int:
    """A position as clients see it, within a range 607Bh of `span` counts from `low`; 0 is no range."""
    return low + (position - low) % span if span else position


@kernel
def nearest(span: int, wanted: float, here: float) -> float:
    """The place that looks like `wanted` nearest to `here`; half a turn goes to the positive side."""
    if not span:
        return wanted
    return wanted - span * math.ceil((wanted - here) / span - 0.5)


@kernel
def command_torque(axes: Any, setpoints: Any, index: int, torque: float) -> None:
    """Torque set point (per mille)."""
    axis, setpoint = axes[index], setpoints[index]
    setpoint["loop"], setpoint["current_offset_a"] = CURRENT, 0.0
    setpoint["current_a"] = int(torque) * axis["torque_sign"] * axis["a_per_torque"]


@kernel
def command_velocity(axes: Any, setpoints: Any, index: int, velocity: float, torque_offset: float) -> None:
    """Velocity set point (counts/s), reached linearly over the next advance."""
    axis, setpoint = axes[index], setpoints[index]
    setpoint["loop"], setpoint["velocity_offset_m_s"] = VELOCITY, 0.0
    setpoint["current_offset_a"] = int(torque_offset) * axis["torque_sign"] * axis["a_per_torque"]
    setpoint["velocity_m_s"] = axis["velocity_sign"] * velocity * axis["m_per_count"]


@kernel
def command_position(
    axes: Any, setpoints: Any, index: int, position: float, velocity_offset: float, torque_offset: float
) -> None:
    """Position set point (user counts), reached linearly over the next advance."""
    axis, setpoint = axes[index], setpoints[index]
    setpoint["loop"] = POSITION
    offset = axis["velocity_sign"] * velocity_offset + 0.0  # no negative zero
    setpoint["velocity_offset_m_s"] = offset * axis["m_per_count"]
    setpoint["current_offset_a"] = int(torque_offset) * axis["torque_sign"] * axis["a_per_torque"]
    setpoint["position_m"] = axis["position_sign"] * (position - axis["origin"]) * axis["m_per_count"]


@kernel
def travel(axis: Any, own: Any) -> tuple[float, float]:
    """Smallest and largest position allowed (user counts): by limit switches and 607Dh.

    With a range 607Bh there is no software limit, unless one inside it keeps the axis from wrapping.
    """
    lowest, highest = own["min_position_limit"], own["max_position_limit"]
    if axis["range_span"]:
        if lowest <= axis["range_low"] and highest >= axis["range_high"]:
            lowest, highest = -math.inf, math.inf
        else:
            lowest, highest = max(lowest, float(axis["range_low"])), min(highest, float(axis["range_high"]))
    return max(lowest, axis["blocked_low"]), min(highest, axis["blocked_high"])


@kernel
def clip_step(axes: Any, index: int, before: float, wanted: float, dt_s: float) -> float:
    """The next of a sequence of position demands, within the speed of the motor, 6080h."""
    way = axes[index]["motor_speed"] * dt_s
    if -way <= wanted - before <= way:
        return wanted
    axes[index]["clipped"] = True
    return before + math.copysign(way, wanted - before)


@kernel
def clip_position(axes: Any, objects: Any, index: int, wanted: float) -> float:
    """A position demand within 607Dh and limit switches (user counts)."""
    axis = axes[index]
    lowest, highest = travel(axis, objects[index])
    if lowest <= wanted <= highest:
        return wanted
    axis["clipped"] = True
    return float(max(lowest, min(highest, wanted)))


@kernel
def clip_velocity(
    axes: Any, objects: Any, index: int, wanted: float, deceleration: float, dt_s: float
) -> float:
    """A velocity demand (counts/s) so that braking at `deceleration` ends at the limit, and within 6080h.

    The largest v with v dt + v^2 / 2a <= distance left.
    """
    axis = axes[index]
    if wanted == 0.0:
        return wanted
    if abs(wanted) > axis["motor_speed"]:
        axis["clipped"] = True
        wanted = math.copysign(axis["motor_speed"], wanted)
    position = axis["position"]
    rising = wanted * (axis["velocity_sign"] * axis["position_sign"]) > 0.0
    lowest, highest = travel(axis, objects[index])
    distance = highest - position if rising else position - lowest
    if distance <= 0.0:
        axis["clipped"] = True
        return 0.0
    step = deceleration * dt_s
    largest = math.sqrt(step * step + 2.0 * deceleration * distance) - step
    if abs(wanted) <= largest:
        return wanted
    axis["clipped"] = True
    return math.copysign(largest, wanted)


@kernel
def clip_torque(axes: Any, objects: Any, index: int, wanted: float) -> float:
    """A torque demand: none further into an active limit switch, none beyond the speed of 6080h."""
    axis = axes[index]
    if wanted == 0.0:
        return 0.0
    side = axis["torque_sign"] * axis["position_sign"] * (1 if wanted > 0.0 else -1)
    blocked = axis["blocked_high"] < math.inf if side > 0 else axis["blocked_low"] > -math.inf
    velocity_side = axis["velocity_sign"] * axis["position_sign"]
    if blocked or objects[index]["velocity_actual_value"] * velocity_side * side >= axis["motor_speed"]:
        axis["clipped"] = True
        return 0.0
    return wanted


@kernel
def read_axis(axes: Any, objects: Any, states: Any, index: int) -> bool:
    """Take the actual values from the plant; return whether they are numbers."""
    axis, own, state = axes[index], objects[index], states[index]
    velocity_m_s = axis["velocity_sign"] * state["encoder_velocity_m_s"]
    current_a = axis["torque_sign"] * state["current_measured_a"]
    seen_m_s = state["carried_velocity_m_s"] if axis["carried"] else state["table_velocity_m_s"]
    if not math.isfinite(velocity_m_s + current_a + seen_m_s):
        return False
    position = axis["origin"] + axis["position_sign"] * state["encoder_counts"]
    axis["position"] = position
    own["position_actual_value"] = shown(axis["range_low"], axis["range_span"], position)
    own["velocity_actual_value"] = round(velocity_m_s * axis["counts_per_m"])
    own["current_actual_value"] = round(current_a * axis["current_per_a"])
    own["torque_actual_value"] = round(current_a * axis["torque_per_a"])
    if axis["scale_counts_per_m"]:
        own["additional_position_actual_value"] = state["scale_counts"]
        own["additional_velocity_actual_value"] = round(seen_m_s * axis["scale_counts_per_m"])
    return True


@kernel
def inputs_of(axes: Any, states: Any, index: int) -> int:
    """Digital inputs 60FDh, by where the table is."""
    axis, position_m, inputs = axes[index], states[index]["table_position_m"], 0
    if position_m <= axis["negative_m"]:
        inputs |= NEGATIVE_SWITCH
    if position_m >= axis["positive_m"]:
        inputs |= POSITIVE_SWITCH
    if axis["home_from_m"] <= position_m <= axis["home_to_m"]:
        inputs |= HOME_SWITCH
    return inputs


@kernel
def check_following(axes: Any, objects: Any, index: int, dt_s: float) -> bool:
    """Update 60F4h; return whether the error has been outside 6065h for longer than 6066h."""
    axis, own = axes[index], objects[index]
    error = own["position_demand_internal_value"] - axis["position"]
    own["following_error_actual_value"] = error
    window = own["following_error_window"]
    if window == NO_WINDOW or abs(error) <= window:
        axis["outside_us"] = 0
        return False
    axis["outside_us"] += round(dt_s * 1e6)
    return bool(axis["outside_us"] > 1000 * own["following_error_time_out"])


@kernel
def follow_axes(
    axes: Any, objects: Any, state: Any, dt_s: float, word: int, limited_word: int, found: Index
) -> bool:
    """Read and supervise axes that cyclic modes lead; `found` (n,) is what, true where any has something.

    The statusword is `word`, or `limited_word` where a limit is active; with a finding the caller makes it.
    """
    anything = False
    for index in range(len(axes)):
        axis, own = axes[index], objects[index]
        found[index] = finding(axes, objects, state, index, dt_s)
        if found[index]:
            anything = True
            continue
        limited = axis["clipped"] or axis["blocked_low"] > -math.inf or axis["blocked_high"] < math.inf
        own["statusword"] = limited_word if limited else word
        axis["clipped"] = False
    return anything


@kernel
def finding(axes: Any, objects: Any, states: Any, index: int, dt_s: float) -> int:
    """Read an axis; what there is that the compiled tick has no answer to."""
    if not read_axis(axes, objects, states, index):
        return NOT_FINITE
    if inputs_of(axes, states, index) != objects[index]["digital_inputs"]:
        return SWITCHED
    if axes[index]["led"] == CYCLIC_POSITION and check_following(axes, objects, index, dt_s):
        return FOLLOWING_ERROR
    return 0
