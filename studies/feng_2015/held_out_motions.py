"""Held-out motions, used for no learning and no choice: a spiral, random splines, a program with rounding.

The indicators are those of the study, at every reversal of an axis with its whole monitoring time.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from hil_sim.config import PlantConfig
from kernels.arrays import Array
from servo_ctrl.config.load import load_program
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.learning.performance import combined, indicators, window_samples
from servo_ctrl.metrology.circles import AXES, ReversalFigures, figures_um
from servo_ctrl.units import MM
from studies.feng_2015.twin_motions import SETTLE_CYCLES, twin_program
from twin.rollout import rollout

RAMP_S = 0.5
"""Duration from standstill to the feed, and back; chosen."""
SPLINE_POINTS, SPLINE_HALF_M = 7, 0.025
"""Random points of a closed spline, and half the side of the square that holds them; chosen."""
SPLINE_FEEDS_MM_MIN, SEED_END = (1000, 2000, 3000), 200
"""Feeds of the splines, and the bound of their seeds; chosen."""
FINE = 20_000
"""Points along a curve from which its length is computed; chosen."""


class Motion(NamedTuple):
    """Commands (n, 4) of each axis."""

    label: str
    reference: dict[str, Array]


def along(label: str, curve_m: Array, feed_m_s: float, period_s: float) -> Motion:
    """Return the motion once along a curve (k, 2), metres, from standstill to standstill on smooth ramps."""
    curve_m = curve_m - curve_m[0]
    length_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(curve_m, axis=0).T))])
    duration_s = length_m[-1] / feed_m_s + RAMP_S
    time_s = np.arange(round(duration_s / period_s) + 1) * period_s
    # the feed rises and falls as 3 s^2 - 2 s^3
    share = np.clip(time_s / RAMP_S, 0.0, 1.0) - np.clip((time_s - duration_s + RAMP_S) / RAMP_S, 0.0, 1.0)
    distance_m = np.cumsum(3.0 * share**2 - 2.0 * share**3) * period_s * feed_m_s
    distance_m *= length_m[-1] / distance_m[-1]
    spline = CubicSpline(length_m, curve_m)
    position_m = np.concatenate(
        [np.zeros((SETTLE_CYCLES, 2)), spline(distance_m), np.repeat(curve_m[-1:], SETTLE_CYCLES, axis=0)]
    )
    velocity_m_s = np.gradient(position_m, period_s, axis=0)
    acceleration_m_s2 = np.gradient(velocity_m_s, period_s, axis=0)
    parts = (position_m, velocity_m_s, acceleration_m_s2, np.zeros_like(position_m))
    return Motion(
        label, {axis: np.column_stack([part[:, index] for part in parts]) for index, axis in enumerate(AXES)}
    )


def spiral_m() -> Array:
    """Return a spiral (k, 2), metres: outwards from 5 to 25 mm in three turns."""
    angle = np.linspace(0.0, 6.0 * np.pi, FINE)
    radius_m = 0.005 + 0.020 * angle / angle[-1]
    return np.column_stack([radius_m * np.cos(angle), radius_m * np.sin(angle)])


def spline_m(seed: int) -> Array:
    """Return a smooth closed curve (k, 2), metres, through random points."""
    rng = np.random.default_rng(seed)
    points_m = rng.uniform(-SPLINE_HALF_M, SPLINE_HALF_M, (SPLINE_POINTS, 2))
    closed_m = np.vstack([points_m, points_m[:1]])
    chord = np.concatenate([[0.0], np.cumsum(np.sqrt(np.hypot(*np.diff(closed_m, axis=0).T)))])
    return np.asarray(CubicSpline(chord, closed_m, bc_type="periodic")(np.linspace(0.0, chord[-1], FINE)))


def held_out_motions(machine: MachineConfig) -> list[Motion]:
    """Return all held-out motions; of each feed the first spline, by seed, within the limits of the axes."""
    period_s = machine.period_s
    folder: Path = machine.source.parent / "programs"
    bracket = twin_program(machine, load_program(folder / "bracket.ngc", machine)).reference
    return [
        along("spiral F 2000", spiral_m(), 2.0 / 60.0, period_s),
        *(_first_spline(machine, feed_mm_min) for feed_mm_min in SPLINE_FEEDS_MM_MIN),
        Motion("bracket.ngc", bracket),
    ]


def _first_spline(machine: MachineConfig, feed_mm_min: int) -> Motion:
    for seed in range(1, SEED_END):
        found = along(f"spline F {feed_mm_min}", spline_m(seed), feed_mm_min / 60e3, machine.period_s)
        if all(
            np.abs(found.reference[name][:, 2]).max() <= axis.limits.acceleration_mm_s2 * MM
            for name, axis in machine.axes.items()
        ):
            return found
    raise ValueError(f"no spline at F {feed_mm_min} is within the limits of acceleration")


def motion_figures(
    machine: MachineConfig, plant: PlantConfig, motion: Motion, params: dict[str, AxisParams]
) -> dict[tuple[str, str], ReversalFigures]:
    """Return the four indicators, micrometres, by (axis, label)."""
    columns = rollout(machine, plant, params, {name: part.copy() for name, part in motion.reference.items()})
    command_m = [columns[f"{axis}.position_command_m"] for axis in AXES]
    error_m = [columns[f"{axis}.position_command_m"] - columns[f"{axis}.scale_position_m"] for axis in AXES]
    step_m = [np.gradient(values) for values in command_m]
    speed_m = np.maximum(np.hypot(*step_m), 1e-12)
    contour_m = (step_m[0] * error_m[1] - step_m[1] * error_m[0]) / speed_m
    window = window_samples(machine.monitoring.window_s, machine.period_s)
    found = {}
    for axis, command in zip(AXES, command_m, strict=True):
        seen = indicators(command, columns[f"{axis}.scale_position_m"], contour_m, window)
        if seen:
            found[axis, motion.label] = figures_um(combined(seen))
    return found
