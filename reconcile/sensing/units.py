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
"""Tolerance of a factor that a wrong unit makes, in decades."""
LARGEST_MASS_RATIO = 3.0
"""Largest ratio of masses that a payload explains; beyond it a unit is wrong."""
LEAST_STANDARD_ERRORS = 8.0
"""Significance of a fitted mass that is compared with the model's."""
LEAST_SWING_RAD = 0.3
"""Swing from which on gravity is no straight line over the angle, where 1 m stands for 1 rad."""
MOST_ROWS = 400_000
"""Rows of the rigid fit; of more samples, evenly spread ones are taken."""
VELOCITY_SAMPLES = 9
"""Moving average of the velocity, samples."""


class RigidFit(NamedTuple):
    """A rigid model with friction, fitted to force and motion."""

    mass_kg: float
    error_kg: float
    reversed_share: float
    """Share of the absolute power that has the wrong sign, 0 to 1."""
    friction_w: float
    """Mean power of the fitted friction: a force of the wrong sign turns it round too, other axes do not."""


def rigid_fit(motor_m: Array, force_n: Array, period_s: float) -> RigidFit | None:
    """Fit mass, friction, and forces at a place (springs, gravity); None where the axis does not move.

    Without the forces at a place, a pendulum that swings below its frequency has a negative mass.
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
    acceleration_m_s2, velocity_m_s, smooth_n = acceleration_m_s2[thin], velocity_m_s[thin], smooth_n[thin]
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
    power_w = (smooth_n - np.median(smooth_n)) * velocity_m_s
    moved_w = float(np.sum(np.abs(power_w)))
    share = float(np.sum(np.maximum(-power_w, 0.0))) / moved_w if moved_w > 0.0 else 0.0
    rubbing_n = matrix[:, 1:3] @ (values[1:3] / scale[1:3])
    return RigidFit(mass_kg, error_kg, share, float(np.mean(rubbing_n * velocity_m_s)))


def factor_meaning(ratio: float, model: NominalAxis) -> str:
    """The wrong unit that makes a force `ratio` times too large; empty where none does."""
    meanings = {
        1e3: "the force is in mN",
        1e-3: "the force is in kN, or the position is in mm but was read as metres",
        1e6: "the position is in m but was read as um",
        1e-6: "the position is in um but was read as metres",
        model.lead_m / (2.0 * math.pi): "it is the motor's torque in N m, not the force at the table",
        1.0 / model.force_constant_n_a: "it is the current in A, not the force",
        model.force_constant_n_a: "the force constant was applied twice, or the current is in another unit",
    }
    for factor, meaning in meanings.items():
        decades = math.log10(factor) if factor > 0.0 else 0.0
        if abs(decades) > 0.3 and abs(math.log10(ratio / factor)) < FACTOR_TOLERANCE_DECADES:
            return meaning
    return ""


def slope(first_m: Array, second_m: Array, period_s: float) -> float | None:
    """Slope of the second position over the first (n,), m/m, regardless of a delay; None without motion."""
    if np.ptp(first_m) <= 0.0 or np.ptp(second_m) <= 0.0:
        return None
    velocity_m_s = uniform_filter1d(np.gradient(first_m, period_s), VELOCITY_SAMPLES)
    matrix = np.column_stack([first_m - first_m.mean(), velocity_m_s, np.gradient(velocity_m_s, period_s)])
    scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    values, *_ = np.linalg.lstsq(matrix / scale, second_m - second_m.mean(), rcond=1e-6)
    return float(values[0] / scale[0])
