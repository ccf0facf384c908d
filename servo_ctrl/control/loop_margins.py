"""Computes robustness of an axis's control law on a rigid mass: open loop, sensitivity peak, noise gain.

The model is linear in z and includes the one-period delay until a set point acts; a test compares it with the
compiled law.
"""

import math

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from servo_ctrl.control.tick import AxisParams

Response = NDArray[np.complex128]
FREQUENCIES = 20_000
"""Number of frequencies up to half the sampling rate; chosen: a step of 0.025 Hz at 1 kHz."""


def open_loop(params: AxisParams, mass_kg: float, frequency_hz: Array) -> Response:
    """Return the transfer function in z from a force on the mass to minus the motor's force."""
    period = params.period_s
    z = np.exp(2j * math.pi * frequency_hz * period)
    mass = rigid_mass(params, mass_kg, frequency_hz)
    velocity = (1.0 - 1.0 / z) / period
    integral = params.velocity_loop.ki_n_m * period / (1.0 - 1.0 / z)
    cascade = (params.velocity_loop.kv_n_s_m + integral) * (params.position_loop.kp_1_s + velocity)
    model, recall = observer_paths(params, z)
    return np.asarray((cascade + model) * mass / z / (1.0 - recall))


def observer_paths(params: AxisParams, z: Response) -> tuple[Response, Response]:
    """Return the observer's force per motor position, N/m, and per earlier force; 0 where it is off."""
    period = params.period_s
    blend = params.observer.filter_blend if params.observer.enabled else 0.0
    low_pass = blend / (1.0 - (1.0 - blend) / z)
    mean = 0.5 * (1.0 + 1.0 / z)
    velocity = (1.0 - 1.0 / z) / period
    model = params.observer.mass_kg * velocity**2 + params.observer.viscous_n_s_m * mean * velocity
    # a command acts after one period, and its current is measured at the end of the period
    return low_pass * model, low_pass * mean / z**2


def rigid_mass(params: AxisParams, mass_kg: float, frequency_hz: Array) -> Response:
    """Return the transfer function from a force held over a period to the position, m/N."""
    z = np.exp(2j * math.pi * frequency_hz * params.period_s)
    return np.asarray(params.period_s**2 * (z + 1.0) / (2.0 * mass_kg * (z - 1.0) ** 2))


def all_frequencies_hz(period_s: float) -> Array:
    """Return evenly spaced frequencies up to half the sampling rate, (n,)."""
    return np.linspace(0.0, 0.5 / period_s, FREQUENCIES + 2)[1:-1]


def sensitivity_peak(params: AxisParams, mass_kg: float) -> float:
    """Return Ms, the largest |1 / (1 + L)|."""
    loop = open_loop(params, mass_kg, all_frequencies_hz(params.period_s))
    return float(np.abs(1.0 / (1.0 + loop)).max())


def noise_gain_n_m(params: AxisParams, mass_kg: float) -> float:
    """Return the RMS force command per RMS white noise in the measured position, N/m."""
    frequency_hz = all_frequencies_hz(params.period_s)
    loop = open_loop(params, mass_kg, frequency_hz)
    to_force = loop / (1.0 + loop) / rigid_mass(params, mass_kg, frequency_hz)
    return float(np.sqrt(np.mean(np.abs(to_force) ** 2)))
