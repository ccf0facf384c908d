"""Limits of a drive in a cyclic mode: software limits 607Dh, limit switches and the motor's speed 6080h.

A clipped demand marks its axis as `clipped`, for the statusword. Arguments as in `drive_step`.
"""

import math
from typing import Any

from kernels.jit import kernel


@kernel
def travel(axis: Any, own: Any) -> tuple[float, float]:
    """Return the smallest and largest allowed position (user counts), by limit switches and 607Dh.

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
def clip_position(axes: Any, objects: Any, index: int, wanted: float) -> float:
    """Clip a position demand (user counts) by 607Dh and limit switches."""
    axis = axes[index]
    lowest, highest = travel(axis, objects[index])
    if lowest <= wanted <= highest:
        return wanted
    axis["clipped"] = True
    return float(max(lowest, min(highest, wanted)))


@kernel
def clip_step(axes: Any, index: int, before: float, wanted: float, dt_s: float) -> float:
    """Clip a position demand so that it follows `before` within the motor's speed 6080h."""
    longest_step = axes[index]["motor_speed"] * dt_s
    if -longest_step <= wanted - before <= longest_step:
        return wanted
    axes[index]["clipped"] = True
    return before + math.copysign(longest_step, wanted - before)


@kernel
def clip_velocity(
    axes: Any, objects: Any, index: int, wanted: float, deceleration: float, dt_s: float
) -> float:
    """Clip a velocity demand (counts/s) by 6080h and so that braking at `deceleration` ends at the limit.

    It is the largest v with v dt + v^2 / 2a <= remaining distance.
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
    """Clip a torque demand: none further into an active limit switch, none beyond the speed of 6080h."""
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
