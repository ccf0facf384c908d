"""Readings of a drive after each advance of the plant: actual values, digital inputs, following error.

Arguments as in `drive_step`; `states` (n,) are the plant's.
"""

import math
from typing import Any

from kernels.jit import kernel

NO_WINDOW = 0xFFFF_FFFF
"""Following error window 6065h that is switched off."""
NEGATIVE_SWITCH, POSITIVE_SWITCH, HOME_SWITCH = 1, 2, 4
"""Digital inputs 60FDh."""


@kernel
def read_axis(axes: Any, objects: Any, states: Any, index: int) -> bool:
    """Write the actual values of the plant to the objects; return whether they are finite."""
    axis, own, state = axes[index], objects[index], states[index]
    velocity_m_s = axis["velocity_sign"] * state["encoder_velocity_m_s"]
    current_a = axis["torque_sign"] * state["current_measured_a"]
    scale_m_s = state["carried_velocity_m_s"] if axis["carried"] else state["table_velocity_m_s"]
    if not math.isfinite(velocity_m_s + current_a + scale_m_s):
        return False
    position = axis["origin"] + axis["position_sign"] * state["encoder_counts"]
    axis["position"] = position
    own["position_actual_value"] = wrapped(axis["range_low"], axis["range_span"], position)
    own["velocity_actual_value"] = round(velocity_m_s * axis["counts_per_m"])
    own["current_actual_value"] = round(current_a * axis["current_per_a"])
    own["torque_actual_value"] = round(current_a * axis["torque_per_a"])
    if axis["scale_counts_per_m"]:
        own["additional_position_actual_value"] = state["scale_counts"]
        own["additional_velocity_actual_value"] = round(scale_m_s * axis["scale_counts_per_m"])
    return True


@kernel
def wrapped(low: int, span: int, position: int) -> int:
    """Return a position wrapped to a range 607Bh of `span` counts from `low`; 0: no range."""
    return low + (position - low) % span if span else position


@kernel
def inputs_of(axes: Any, states: Any, index: int) -> int:
    """Return digital inputs 60FDh at the position of the table."""
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
