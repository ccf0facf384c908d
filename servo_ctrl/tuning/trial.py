"""The proof: the same step of force, move and circle before and after, and what they show.

A machine of one axis makes a sine in place of the circle. Errors are those of the scale, of the motor where
there is none.
"""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.canopen.scaling import drive_scaling, scale_metre_per_count
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.tuning.measurement import samples_step
from servo_ctrl.units import MM, UM

FORCE_SHARE = 0.1
"""Of the force limit: the step of force. Chosen, as all numbers here."""
STEP_S = 0.5
MOVE_MM, RADIUS_MM, TRAVEL_SHARE = 5.0, 10.0, 0.1
"""Largest move and radius, and their share of the travel between the limits."""
MOVE_SPEED_SHARE, CIRCLE_SPEED_SHARE, ACCELERATION_SHARE = 0.5, 0.2, 0.1
"""Of the limits: speed of the move, speed and acceleration of the circle."""
SETTLED_M, SETTLED_COUNTS = 1.0 * UM, 2.0
DYING, QUIET_M = 0.8, 0.3 * UM
"""What swings dies away to less than this share within half a second, or is smaller than that."""
STEP, MOVE, BACK, ROUND = "step of force", "move", "rest behind the move", "circle"


class StepAndMove(NamedTuple):
    """What a setting has shown; NaN where it was not shown."""

    step_peak_m: float
    """Largest deviation behind the step of force."""
    step_settling_s: float
    """Until it stays within a tenth of that, and of the last digit."""
    move_peak_m: float
    """Largest deviation along the move."""
    move_settling_s: float
    """From the end of the command until the axis stays within 1 um, or two digits."""
    circle_peak_m: float
    """Largest contour error of the circle, or deviation along the sine."""
    circle_rms_m: float
    rest_rms_m: float
    """Of the deviation at rest."""
    hums: bool
    """At rest the deviation does not die away: friction that holds makes another plant of the axis."""


class Traces(NamedTuple):
    """Time and deviation of the parts, for the pictures."""

    step: tuple[Array, Array]
    move: tuple[Array, Array]
    circle: tuple[Array, Array]


def proving_steps(machine: MachineConfig, axis: str, folder: Path) -> list[dict[str, Any]]:
    """Steps of a program file that begin in the middle of the limits."""
    limits = machine.axes[axis].limits
    middle_mm = sum(limits.position_mm) / 2.0
    span_mm = limits.position_mm[1] - limits.position_mm[0]
    feed = 60.0 * MOVE_SPEED_SHARE * limits.velocity_mm_s
    count = round(STEP_S / machine.period_s)
    force_n = np.concatenate(
        (np.zeros(count // 5), np.full(count, FORCE_SHARE * limits.force_n), np.zeros(count))
    )
    still_m = np.full(len(force_n), middle_mm * MM)
    steps = [
        {"kind": "move", "label": "to the middle", "to_mm": {axis: middle_mm}, "feed_mm_min": feed},
        {"kind": "dwell", "label": "rest in the middle", "seconds": 2.0 * STEP_S},
        samples_step(axis, STEP, still_m, force_n, machine.period_s, folder),
        {
            "kind": "move",
            "label": MOVE,
            "to_mm": {axis: middle_mm + min(MOVE_MM, TRAVEL_SHARE * span_mm)},
            "feed_mm_min": feed,
        },
        {"kind": "dwell", "label": BACK, "seconds": STEP_S},
    ]
    return steps + _round_steps(machine, axis)


def _round_steps(machine: MachineConfig, axis: str) -> list[dict[str, Any]]:
    axes = [axis, *(name for name in machine.axes if name != axis)][:2]
    all_limits = [machine.axes[name].limits for name in axes]
    radius_mm = min(
        RADIUS_MM, *(TRAVEL_SHARE * (one.position_mm[1] - one.position_mm[0]) for one in all_limits)
    )
    speed_mm_s = min(
        *(CIRCLE_SPEED_SHARE * one.velocity_mm_s for one in all_limits),
        *(math.sqrt(ACCELERATION_SHARE * one.acceleration_mm_s2 * radius_mm) for one in all_limits),
    )
    middles = [sum(one.position_mm) / 2.0 for one in all_limits]
    start = dict(zip(axes, middles, strict=True))
    feed = 60.0 * MOVE_SPEED_SHARE * min(one.velocity_mm_s for one in all_limits)
    if len(axes) == 1:
        motion = {
            "kind": "sine",
            "label": ROUND,
            "axis": axis,
            "amplitude_mm": radius_mm,
            "frequency_hz": speed_mm_s / radius_mm / (2.0 * math.pi),
            "cycles": 2.0,
        }
    else:
        start[axis] += radius_mm
        motion = {
            "kind": "circle",
            "label": ROUND,
            "axes": axes,
            "radius_mm": radius_mm,
            "feed_mm_min": 60.0 * speed_mm_s,
            "turns": 2.0,
        }
    return [
        {"kind": "move", "label": "to the circle", "to_mm": start, "feed_mm_min": feed},
        {"kind": "dwell", "label": "rest before the circle", "seconds": STEP_S},
        motion,
    ]


def evaluate(
    machine: MachineConfig, axis: str, segment: Callable[[str], Mapping[str, Array]]
) -> tuple[StepAndMove, Traces]:
    """The indicators of a recording; `segment`: the columns of the step of that name."""
    period_s = machine.period_s

    def deviation(columns: Mapping[str, Array], name: str = axis) -> Array:
        source = "scale" if machine.axes[name].scale is not None else "motor"
        return columns[f"{name}.position_command_m"] - columns[f"{name}.{source}_position_m"]

    config = machine.axes[axis]
    digit_m = (
        scale_metre_per_count(config) if config.scale is not None else drive_scaling(config).metre_per_count
    )
    rest = deviation(segment("rest in the middle"))
    early, late = (float(np.std(part)) for part in np.split(rest[-3 * (len(rest) // 4) :], 3)[::2])
    hums = late > max(DYING * early, SETTLED_COUNTS * digit_m, QUIET_M)
    rest = rest[len(rest) // 2 :]
    count = round(STEP_S / period_s)
    step = deviation(segment(STEP))
    step = step[count // 5 - 1 : count // 5 + count] - float(np.mean(rest))
    step_peak = float(np.abs(step).max())
    move, behind = deviation(segment(MOVE)), deviation(segment(BACK))
    band_m = max(SETTLED_M, SETTLED_COUNTS * digit_m)
    columns = segment(ROUND)
    turning = _contour_error(machine, axis, columns, deviation)
    steady = turning[len(turning) // 4 : -len(turning) // 8]
    trial = StepAndMove(
        step_peak_m=step_peak,
        step_settling_s=_settling_s(step, max(0.1 * step_peak, SETTLED_COUNTS * digit_m), period_s),
        move_peak_m=float(np.abs(move).max()),
        move_settling_s=_settling_s(behind, band_m, period_s),
        circle_peak_m=float(np.abs(steady).max()),
        circle_rms_m=float(np.sqrt(np.mean(steady**2))),
        rest_rms_m=float(np.std(rest)),
        hums=hums,
    )
    moved = np.concatenate((move, behind))
    step_trace, move_trace, circle_trace = (
        (np.asarray(np.arange(len(values)) * period_s, dtype=np.float64), values)
        for values in (step, moved, turning)
    )
    return trial, Traces(step_trace, move_trace, circle_trace)


def _contour_error(
    machine: MachineConfig,
    axis: str,
    columns: Mapping[str, Array],
    deviation: Callable[[Mapping[str, Array], str], Array],
) -> Array:
    """Distance to the circle along its radius, positive outside; of one axis, its deviation."""
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
    """Until the deviation stays within the band; NaN where it does not."""
    outside = np.flatnonzero(np.abs(deviation_m) > band_m)
    if not len(outside):
        return 0.0
    return math.nan if outside[-1] >= len(deviation_m) - 1 else float(outside[-1] + 1) * period_s
