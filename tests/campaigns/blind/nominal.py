"""Fit the nominal model (mass, viscous and Coulomb friction) on the recordings, and write its file."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.signal import butter, sosfiltfilt

from tests.campaigns.blind.arrays import Array
from tests.campaigns.blind.case import Case

CORNER_HZ = 40.0
"""Corner of the low pass before the fit, Hz; chosen."""
EDGE_S = 0.2
"""Span at either end that the low pass distorts, seconds; chosen."""


def fitted(recordings: Sequence[dict[str, Array]]) -> tuple[float, float, float]:
    """Fit the inverse dynamics to all recordings; the fit absorbs what it can of the concealed effects."""
    rows, forces = [], []
    for columns in recordings:
        own = {name.removeprefix("x."): values for name, values in columns.items()}
        x, v, a, force = smooth(own["time_s"], own["motor_position_m"], own["motor_force_n"])
        slow = 0.01 * np.abs(v).max()
        moving = np.abs(v) > slow
        edge = round(EDGE_S / float(own["time_s"][1] - own["time_s"][0]))
        moving[:edge] = moving[-edge:] = False
        rows.append(np.stack((a, v, np.sign(v), np.ones_like(x)), axis=1)[moving])
        forces.append(force[moving])
    theta, *_ = np.linalg.lstsq(np.concatenate(rows), np.concatenate(forces), rcond=None)
    return float(max(theta[0], 0.1)), float(max(theta[1], 0.0)), float(max(theta[2], 0.0))


def smooth(time_s: Array, position_m: Array, force_n: Array) -> tuple[Array, Array, Array, Array]:
    """Return position (n,), velocity, acceleration and force, SI, after one zero-phase low pass."""
    period_s = float(time_s[1] - time_s[0])
    low_pass = butter(2, CORNER_HZ * 2.0 * period_s, output="sos")
    x, force = sosfiltfilt(low_pass, np.stack((position_m, force_n)))
    v = np.gradient(x, period_s)
    return x, v, np.gradient(v, period_s), force


def model_text(case: Case, values: tuple[float, float, float]) -> str:
    """Return the smallest plant file that a diagnosis accepts."""
    mass_kg, viscous, coulomb_n = values
    torque_nm_a = 5.0 * case.lead_m / (2.0 * math.pi)
    text = f"""[axis.x.transmission]
lead_mm = {case.lead_m * 1e3!r}
[axis.x.motor]
torque_constant_nm_a = {torque_nm_a!r}
[axis.x.table]
mass_kg = {mass_kg!r}
[axis.x.viscous_friction]
viscous_n_s_m = {viscous!r}
[axis.x.coulomb_friction]
coulomb_n = {coulomb_n!r}
[axis.x.encoder]
counts_per_rev = {round(case.lead_m / case.plant.motor_count_m)}
"""
    if case.sensing.has_scale:
        text += f"[axis.x.scale]\nresolution_um = {case.plant.scale_count_m * 1e6!r}\n"
    if case.towing:
        text += f"""[axis.y.transmission]
lead_mm = {case.lead_m * 1e3!r}
[axis.y.motor]
torque_constant_nm_a = {torque_nm_a!r}
[axis.y.table]
mass_kg = 30.0
[axis.y.viscous_friction]
viscous_n_s_m = 60.0
[axis.y.coulomb_friction]
coulomb_n = 8.0
"""
    return text
