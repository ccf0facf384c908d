"""Rows of the recorder, from commands and positions."""

import math
from collections.abc import Sequence

import numpy as np

from kernels.arrays import Array
from servo_ctrl.recording.channels import channels_of


def rows_of(
    axes: Sequence[str],
    command_m: Array,
    position_m: Array,
    period_s: float,
    *,
    velocity_m_s: Array | None = None,
    motor_m: Array | None = None,
    cycle: Array | None = None,
    segment: Array | None = None,
) -> list[list[float]]:
    """Rows of the recording for commands and scale positions (n, axes).

    Velocity, cycle and segment have defaults. All other channels are NaN, the motor encoder too: a reader
    that took it for the scale would fail.
    """
    count = len(command_m)
    if velocity_m_s is None:
        velocity_m_s = np.diff(command_m, axis=0, prepend=command_m[:1]) / period_s
    if cycle is None:
        cycle = np.arange(count, dtype=np.float64)
    values = {
        "time_s": cycle * period_s,
        "cycle": cycle,
        "segment": np.zeros(count) if segment is None else segment,
    }
    for i, axis in enumerate(axes):
        values |= {
            f"{axis}.position_command_m": command_m[:, i],
            f"{axis}.velocity_command_m_s": velocity_m_s[:, i],
            f"{axis}.scale_position_m": position_m[:, i],
        }
        if motor_m is not None:
            values[f"{axis}.motor_position_m"] = motor_m[:, i]
    missing = np.full(count, math.nan)
    table = np.column_stack([values.get(channel.name, missing) for channel in channels_of(axes)])
    return table.tolist()
