"""Checks of signs and units: force against acceleration, and positions against each other."""

import math
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import butter, sosfiltfilt

from kernels.arrays import Array
from reconcile.formats.nominal_axis import NominalAxis

CORNER_HZ = 20.0
"""Low pass of positions and force, Hz."""
FACTOR_TOLERANCE_DECADES = 0.15
"""Tolerance of the factor of a wrong unit, in decades."""
LARGEST_MASS_RATIO = 3.0
"""Largest ratio of masses that a payload explains; beyond it a unit is wrong."""
LEAST_STANDARD_ERRORS = 8.0
"""Significance of a fitted mass that is compared with the model's."""
LONGEST_TRAVEL_M = 8.0
"""Longest plausible travel in metres: that of large gantries."""
LEAST_MISREAD_M = 0.3
"""Least travel of a position that may have been read in too large a unit; with less it hardly moved."""
LEAST_SWING_RAD = 0.3
"""Least swing at which gravity is not linear over the angle, where 1 m stands for 1 rad."""
MOST_ROWS = 400_000
"""Most rows of the rigid fit; more samples are thinned evenly."""
VELOCITY_SAMPLES = 9
"""Moving average of the velocity, samples."""
ROUNDING = 1e-9
"""Range of a position over its largest value up to which it stands still: doubles have 1e-16; chosen."""


class RigidFit(NamedTuple):
    """A rigid model with friction, fitted to force and motion."""

    mass_kg: float
    error_kg: float
    reversed_share: float
    """Share of the absolute power that has the wrong sign, 0 to 1."""
    friction_w: float
    """Mean power of the friction; negative where it drives."""
    residual_share: float
    """Share of the variance of the force in the residual."""


class RigidColumns(NamedTuple):
    """Low-passed columns of a rigid axis, arrays (n,) except for `matrix`."""

    matrix: Array
    """(n, k): acceleration, velocity, direction, and position-dependent forces (springs, gravity)."""
    velocity: Array
    acceleration: Array
    force_n: Array


def rigid_columns(motor_m: Array, force_n: Array, period_s: float) -> RigidColumns | None:
    """Return the columns of a rigid axis; None where the axis or its force does not change.

    Without position-dependent forces, a pendulum that swings below its natural frequency has a negative mass.
    """
    low_pass = butter(2, min(CORNER_HZ * 2.0 * period_s, 0.5), output="sos")
    smooth_m, smooth_n = sosfiltfilt(low_pass, np.stack([motor_m - motor_m[0], force_n]))
    velocity_m_s = np.gradient(smooth_m, period_s)
    acceleration_m_s2 = np.gradient(velocity_m_s, period_s)
    fast = float(np.percentile(np.abs(velocity_m_s), 95.0))
    if fast <= 0.0 or not np.ptp(smooth_n):
        return None
    direction = np.tanh(velocity_m_s / (0.02 * fast))
    places = [np.ones_like(direction), smooth_m]
    if np.ptp(smooth_m) > LEAST_SWING_RAD:
        places += [np.sin(motor_m), np.cos(motor_m)]
    # a long recording needs no more rows, and its matrix would take hundreds of megabytes
    thin = slice(None, None, -(-len(direction) // MOST_ROWS))
    matrix = np.column_stack([of[thin] for of in (acceleration_m_s2, velocity_m_s, direction, *places)])
    return RigidColumns(matrix, velocity_m_s[thin], acceleration_m_s2[thin], smooth_n[thin])


def rigid_fit(columns: RigidColumns) -> RigidFit:
    """Fit mass, friction, and position-dependent forces."""
    matrix, acceleration_m_s2, smooth_n = columns.matrix, columns.acceleration, columns.force_n
    scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    masses = []
    for rows in np.array_split(np.arange(len(matrix)), 8):
        # a block at constant speed does not determine the mass
        if np.std(acceleration_m_s2[rows]) > 0.2 * np.std(acceleration_m_s2):
            values, *_ = np.linalg.lstsq(matrix[rows] / scale, smooth_n[rows], rcond=1e-6)
            masses.append(float(values[0] / scale[0]))
    values, *_ = np.linalg.lstsq(matrix / scale, smooth_n, rcond=1e-6)
    mass_kg = float(values[0] / scale[0])
    error_kg = float(np.std(masses) / math.sqrt(len(masses))) if len(masses) > 2 else math.inf
    power_w = (smooth_n - np.median(smooth_n)) * columns.velocity
    moved_w = float(np.sum(np.abs(power_w)))
    share = float(np.sum(np.maximum(-power_w, 0.0))) / moved_w if moved_w > 0.0 else 0.0
    friction_n = matrix[:, 1:3] @ (values / scale)[1:3]
    residual_n = smooth_n - matrix @ (values / scale)
    residual_share = float(residual_n.var() / max(smooth_n.var(), 1e-300))
    friction_w = float(np.mean(friction_n * columns.velocity))
    return RigidFit(mass_kg, error_kg, share, friction_w, residual_share)


class Meaning(NamedTuple):
    """The cause of a factor in force over acceleration, and its correction."""

    words: str
    channel: str
    """Field of the misread channel."""
    to_si: float
    """Factor that corrects the misread values."""


def factor_meanings(ratio: float, model: NominalAxis, travel_m: float) -> list[Meaning]:
    """Return the wrong units for which a force is `ratio` times too large for the motion, likeliest first."""
    position = "the position is in {} but was read as " + ("radians" if model.rotary else "metres")
    far = travel_m > LONGEST_TRAVEL_M
    meanings: list[tuple[float, Meaning]] = [
        (1e3, Meaning("the force is in mN", "force_n", 1e-3)),
        (1e-3, Meaning("the force is in kN", "force_n", 1e3)),
        (1e-3, Meaning(position.format("mrad" if model.rotary else "mm"), "motor_m", 1e-3)),
        (1e6, Meaning("the position is in m but was read as um", "motor_m", 1e6)),
        (1e-6, Meaning(position.format("urad" if model.rotary else "um"), "motor_m", 1e-6)),
    ]
    if not model.rotary:
        screw = model.lead_m / (2.0 * math.pi)
        torque = "it is the motor's torque in N m, not the force at the table"
        meanings.append((screw, Meaning(torque, "force_n", 1.0 / screw)))
        meanings.append((screw, Meaning(position.format("rad of the motor"), "motor_m", screw)))
        turns = Meaning(position.format("turns of the motor"), "motor_m", model.lead_m)
        meanings.append((model.lead_m, turns))
    else:
        meanings.append((math.pi / 180.0, Meaning(position.format("degrees"), "motor_m", math.pi / 180.0)))
        meanings.append((2.0 * math.pi, Meaning(position.format("turns"), "motor_m", 2.0 * math.pi)))
    if model.encoder_resolution_m:
        counts = Meaning(position.format("counts"), "motor_m", model.encoder_resolution_m)
        meanings.append((model.encoder_resolution_m, counts))
    constant = model.force_constant_n_a
    meanings += [
        (1.0 / constant, Meaning("it is the current in A, not the force", "force_n", constant)),
        (
            constant,
            Meaning(
                "the force constant was applied twice, or the current is in another unit",
                "force_n",
                1.0 / constant,
            ),
        ),
    ]
    found = []
    for factor, meaning in meanings:
        decades = math.log10(factor) if factor > 0.0 else 0.0
        near = abs(decades) > 0.3 and abs(math.log10(ratio / factor)) < FACTOR_TOLERANCE_DECADES
        # the travel of the machine distinguishes a wrong position from a wrong force
        if near and (meaning.channel == "force_n" or factor > 1.0 or travel_m > LEAST_MISREAD_M):
            found.append((far and meaning.channel == "force_n", abs(math.log10(ratio / factor)), meaning))
    return [meaning for _, _, meaning in sorted(found, key=lambda one: one[:2])]


def slope(first_m: Array, second_m: Array, period_s: float) -> float | None:
    """Return the slope of the second position over the first (n,), free of a delay; None without motion."""
    if any(np.ptp(position_m) <= ROUNDING * np.abs(position_m).max() for position_m in (first_m, second_m)):
        return None
    velocity_m_s = uniform_filter1d(np.gradient(first_m, period_s), VELOCITY_SAMPLES)
    matrix = np.column_stack([first_m - first_m.mean(), velocity_m_s, np.gradient(velocity_m_s, period_s)])
    scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    values, *_ = np.linalg.lstsq(matrix / scale, second_m - second_m.mean(), rcond=1e-6)
    return float(values[0] / scale[0])


def lateness(command_m: Array, actual_m: Array, period_s: float) -> tuple[float, float]:
    """Return the delay of a position relative to its command (n,), s, and its standard error, from their lag.

    The error is infinite where fewer than three blocks move.
    """
    velocity_m_s = uniform_filter1d(np.gradient(command_m, period_s), VELOCITY_SAMPLES)
    ones = np.ones_like(command_m)
    columns = np.column_stack([command_m, velocity_m_s, np.gradient(velocity_m_s, period_s), ones])
    moving = 0.2 * float(np.std(velocity_m_s))
    found = []
    for rows in np.array_split(np.arange(len(columns)), 8):
        scale = np.maximum(np.abs(columns[rows]).max(axis=0), 1e-300)
        if float(np.std(velocity_m_s[rows])) > moving:
            values, *_ = np.linalg.lstsq(columns[rows] / scale, actual_m[rows], rcond=1e-9)
            gain, lag = values[0] / scale[0], values[1] / scale[1]
            found.append(-float(lag / gain) if gain else 0.0)
    if len(found) < 3:
        return 0.0, math.inf
    return float(np.median(found)), float(np.std(found) / math.sqrt(len(found)))
