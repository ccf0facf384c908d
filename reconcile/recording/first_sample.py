"""Initial state of a replay: position and velocity of the first sample, stored in the state of a plant."""

from typing import Any

import numpy as np

from reconcile.recording.recording import AxisRecording

FITTED_SAMPLES = 20
"""Samples of the fitted parabola that gives position and velocity at the first sample."""


def initial_motion(recording: AxisRecording) -> tuple[float, float]:
    """Return position (m) and velocity (m/s) at the first sample."""
    count = min(FITTED_SAMPLES, len(recording.time_s))
    _, velocity_m_s, position_m = np.polyfit(recording.time_s[:count], recording.motor_m[:count], 2)
    return float(position_m), float(velocity_m_s)


def set_initial_motion(params: Any, state: Any, position_m: float, velocity_m_s: float) -> None:
    """Set position and velocity of a plant's axis; encoder and scale count from the machine's zero."""
    shift_m = position_m - float(state["motor_position_m"])
    for name in ("motor_position_m", "table_position_m", "carried_position_m"):
        state[name] += shift_m
    for name in ("motor_velocity_m_s", "table_velocity_m_s", "carried_velocity_m_s"):
        state[name] = velocity_m_s
    state["encoder_origin_counts"] = state["scale_origin_counts"] = 0
    state["encoder_counts"] = round(position_m / float(params["encoder"]["resolution_m"]))
    if params["scale"]["enabled"]:
        state["scale_counts"] = round(position_m / float(params["scale"]["resolution_m"]))
