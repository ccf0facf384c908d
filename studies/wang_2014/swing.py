"""Measures how the structure of a stage swings after a move, for its input shaper.

A trapezoid ends with a step of acceleration, after which the scale swings against the motor. The frequency is
that of the largest line of its spectrum, the damping is from what is left in the second half of the rest.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program import program_segments
from servo_ctrl.config.steps import program_steps
from studies.twin_axis import set_points
from studies.wang_2014.plan import AT_100MM, AXIS, plan_series
from studies.wang_2014.stages import STAGES
from twin.axis_rollout import AxisRollout

REST_S = 0.9
"""Time of the rest after the move that is evaluated; chosen: within the dwell before a reading."""
PADDING = 16
"""Length of the spectrum over that of the rest; chosen: its lines are 0.07 Hz apart."""
DAMPING_MAX = 0.7
"""Largest damping ratio of an input shaper."""


class Swing(NamedTuple):
    """A lightly damped oscillation."""

    frequency_hz: float
    damping_ratio: float


def measured_swing(machine: MachineConfig, axis: AxisRollout) -> Swing:
    """Move once by a trapezoid from home, and return the swing of the scale against the motor."""
    plan = plan_series(machine, STAGES["uncompensated"], AT_100MM, 1)
    column, rest = list(machine.axes).index(AXIS), round(REST_S / machine.period_s)
    start_m = [0.0] * len(machine.axes)
    for segment in program_segments(program_steps(plan.program, machine), machine, start_m):
        rows = axis.rows(set_points(segment, column))
        if segment.step in plan.visits:
            deflection_m = rows["scale_position_m"] - rows["motor_position_m"]
            return swing_of(deflection_m[-rest:], machine.period_s)
    raise ValueError("the program has no reading")


def swing_of(deflection_m: Array, period_s: float) -> Swing:
    """Return the swing in the deflection (n,) of a structure behind an axis at rest."""
    around_m = deflection_m - deflection_m.mean()
    length = PADDING * len(around_m)
    spectrum = np.abs(np.fft.rfft(around_m * np.hanning(len(around_m)), length))
    frequency_hz = float(np.argmax(spectrum)) / (length * period_s)
    half = len(around_m) // 2
    left = float(np.std(around_m[half : 2 * half]) / np.std(around_m[:half]))
    damping_ratio = -math.log(left) / (half * period_s) / (2.0 * math.pi * frequency_hz)
    return Swing(frequency_hz, min(max(damping_ratio, 0.0), DAMPING_MAX))
