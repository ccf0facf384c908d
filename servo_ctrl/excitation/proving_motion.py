"""The motion that tries a setting out: a step of force, a move and a circle, as steps of a program.

A machine with one axis makes a sine instead of the circle.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np

from servo_ctrl.config.model import MachineConfig
from servo_ctrl.excitation.measuring_motion import samples_step
from servo_ctrl.units import MM

FORCE_SHARE = 0.1
"""The step of force, as a share of the force limit. Chosen, as are all numbers here."""
STEP_S = 0.5
"""Duration of the step of force, and of the dwells after the moves."""
MOVE_MM, RADIUS_MM, TRAVEL_SHARE = 5.0, 10.0, 0.1
"""Largest move and radius, and their largest share of the distance between the position limits."""
MOVE_SPEED_SHARE, CIRCLE_SPEED_SHARE, ACCELERATION_SHARE = 0.5, 0.2, 0.1
"""Speed of the move, speed and acceleration of the circle, as shares of the limits."""
STEP, MOVE, AFTER_MOVE, CIRCLE = "step of force", "move", "rest after the move", "circle"
"""Labels of the evaluated steps; `AFTER_MOVE` is the dwell after the move."""


def proving_steps(machine: MachineConfig, axis: str, folder: Path) -> list[dict[str, Any]]:
    """Return the steps of a program file, which begin in the middle of the limits.

    The samples of the step of force are written into a file of `folder`.
    """
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
        samples_step(
            axis, STEP, position_m=still_m, force_n=force_n, period_s=machine.period_s, folder=folder
        ),
        {
            "kind": "move",
            "label": MOVE,
            "to_mm": {axis: middle_mm + min(MOVE_MM, TRAVEL_SHARE * span_mm)},
            "feed_mm_min": feed,
        },
        {"kind": "dwell", "label": AFTER_MOVE, "seconds": STEP_S},
    ]
    return steps + _circle_steps(machine, axis)


def _circle_steps(machine: MachineConfig, axis: str) -> list[dict[str, Any]]:
    """A circle with the next axis, or a sine if there is none, within the limits of all axes that move."""
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
            "label": CIRCLE,
            "axis": axis,
            "amplitude_mm": radius_mm,
            "frequency_hz": speed_mm_s / radius_mm / (2.0 * math.pi),
            "cycles": 2.0,
        }
    else:
        start[axis] += radius_mm
        motion = {
            "kind": "circle",
            "label": CIRCLE,
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
