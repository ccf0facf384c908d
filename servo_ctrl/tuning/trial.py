"""The indicators of the trial of a setting, which `excitation.proving_motion` makes.

Deviations are those of the scale, or of the motor
if there is no scale.
"""

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array, rms
from servo_ctrl.canopen.scaling import drive_scaling, scale_metre_per_count
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.excitation.proving_motion import AFTER_MOVE, CIRCLE, MOVE, STEP, STEP_S
from servo_ctrl.units import UM

SETTLED_M, SETTLED_COUNTS = 1.0 * UM, 2.0
"""Band within which a move has settled: the larger of metres and encoder counts."""
DECAY_SHARE, QUIET_M = 0.8, 0.3 * UM
"""An oscillation at rest decays to less than this share within half a second, or is smaller than this RMS."""


class StepAndMove(NamedTuple):
    """Indicators of a trial; NaN where a deviation did not settle."""

    step_peak_m: float
    """Largest deviation after the step of force."""
    step_settling_s: float
    """Until the deviation stays within a tenth of that, or two encoder counts."""
    move_peak_m: float
    """Largest deviation during the move."""
    move_settling_s: float
    """From the end of the command until the deviation stays within 1 um, or two encoder counts."""
    circle_peak_m: float
    """Largest contour error on the circle, or deviation on the sine."""
    circle_rms_m: float
    rest_rms_m: float
    """Standard deviation of the deviation at rest."""
    hums: bool
    """Whether the axis oscillates at rest without decay: sticking friction makes another plant of it."""


class Traces(NamedTuple):
    """Time (s) and deviation (m) of the three parts, (n,) each, for the pictures."""

    step: tuple[Array, Array]
    move: tuple[Array, Array]
    circle: tuple[Array, Array]


def evaluate(
    machine: MachineConfig, axis: str, segment: Callable[[str], Mapping[str, Array]]
) -> tuple[StepAndMove, Traces]:
    """Compute the indicators of a recording. `segment` returns the columns of the step with a label."""
    period_s = machine.period_s

    def deviation(columns: Mapping[str, Array], name: str = axis) -> Array:
        source = "scale" if machine.axes[name].scale is not None else "motor"
        return columns[f"{name}.position_command_m"] - columns[f"{name}.{source}_position_m"]

    config = machine.axes[axis]
    count_m = (
        scale_metre_per_count(config) if config.scale is not None else drive_scaling(config).metre_per_count
    )
    rest = deviation(segment("rest in the middle"))
    early, late = (float(np.std(part)) for part in np.split(rest[-3 * (len(rest) // 4) :], 3)[::2])
    hums = late > max(DECAY_SHARE * early, SETTLED_COUNTS * count_m, QUIET_M)
    rest = rest[len(rest) // 2 :]
    count = round(STEP_S / period_s)
    step = deviation(segment(STEP))
    step = step[count // 5 - 1 : count // 5 + count] - float(np.mean(rest))
    step_peak = float(np.abs(step).max())
    move, after_move = deviation(segment(MOVE)), deviation(segment(AFTER_MOVE))
    band_m = max(SETTLED_M, SETTLED_COUNTS * count_m)
    columns = segment(CIRCLE)
    contour_m = _contour_error(machine, axis, columns, deviation)
    steady = contour_m[len(contour_m) // 4 : -len(contour_m) // 8]
    trial = StepAndMove(
        step_peak_m=step_peak,
        step_settling_s=_settling_s(step, max(0.1 * step_peak, SETTLED_COUNTS * count_m), period_s),
        move_peak_m=float(np.abs(move).max()),
        move_settling_s=_settling_s(after_move, band_m, period_s),
        circle_peak_m=float(np.abs(steady).max()),
        circle_rms_m=rms(steady),
        rest_rms_m=float(np.std(rest)),
        hums=hums,
    )
    moved = np.concatenate((move, after_move))
    step_trace, move_trace, circle_trace = (
        (np.asarray(np.arange(len(values)) * period_s, dtype=np.float64), values)
        for values in (step, moved, contour_m)
    )
    return trial, Traces(step_trace, move_trace, circle_trace)


def _contour_error(
    machine: MachineConfig,
    axis: str,
    columns: Mapping[str, Array],
    deviation: Callable[[Mapping[str, Array], str], Array],
) -> Array:
    """Radial deviation from the circle, positive outside, m, (n,); of a single axis, its deviation."""
    if len(machine.axes) == 1:
        return deviation(columns, axis)
    other = next(name for name in machine.axes if name != axis)
    command = [columns[f"{name}.position_command_m"] for name in (axis, other)]
    centre = [0.5 * (float(values.max()) + float(values.min())) for values in command]
    actual = [values - deviation(columns, name) for values, name in zip(command, (axis, other), strict=True)]
    radius = np.hypot(*(values - middle for values, middle in zip(command, centre, strict=True)))
    return np.asarray(
        np.hypot(*(values - middle for values, middle in zip(actual, centre, strict=True))) - radius
    )


def _settling_s(deviation_m: Array, band_m: float, period_s: float) -> float:
    """Time until the deviation stays within the band, s; NaN where it does not."""
    outside = np.flatnonzero(np.abs(deviation_m) > band_m)
    if not len(outside):
        return 0.0
    return math.nan if outside[-1] >= len(deviation_m) - 1 else float(outside[-1] + 1) * period_s
