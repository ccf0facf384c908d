"""Where a replay sets off: place and speed of a recording's first sample, put into a plant's state."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from reconcile.recording import AxisRecording

START = 20
"""Samples whose parabola tells the position and velocity at the first one."""


def start_of(recording: AxisRecording) -> tuple[float, float]:
    """Position and velocity at the first sample."""
    count = min(START, len(recording.time_s))
    _, slope_m_s, place_m = np.polyfit(recording.time_s[:count], recording.motor_m[:count], 2)
    return float(place_m), float(slope_m_s)


def set_off(params: Any, state: Any, place_m: float, velocity_m_s: float) -> None:
    """The axis at a place and in motion; counts from the machine's zero."""
    shift_m = place_m - float(state["motor_position_m"])
    for name in ("motor_position_m", "table_position_m", "carried_position_m"):
        state[name] += shift_m
    for name in ("motor_velocity_m_s", "table_velocity_m_s", "carried_velocity_m_s"):
        state[name] = velocity_m_s
    state["encoder_origin_counts"] = state["scale_origin_counts"] = 0
    state["encoder_counts"] = round(place_m / float(params["encoder"]["resolution_m"]))
    if params["scale"]["enabled"]:
        state["scale_counts"] = round(place_m / float(params["scale"]["resolution_m"]))
