"""Computes robustness of an axis's control law on a rigid mass: open loop, sensitivity peak, noise gain.

The model is linear in z and includes the one-period delay until a set point acts; a test compares it with the
compiled law.
"""

import math

import numpy as np

from kernels.arrays import Array, rms
from servo_ctrl.control.axis_loop import (
    Response,
    characteristic_of,
    coupled_loop_of,
    integrators_of,
    rigid_mass,
    rigid_plant,
)
from servo_ctrl.control.stability import is_stable
from servo_ctrl.control.tick import AxisParams

FREQUENCIES = 20_000
"""Number of frequencies up to half the sampling rate; chosen: a step of 0.025 Hz at 1 kHz."""


def open_loop(params: AxisParams, mass_kg: float, frequency_hz: Array) -> Response:
    """Return the transfer function in z from a force on the mass to minus the motor's force."""
    return coupled_loop_of(params, rigid_plant(params.period_s, mass_kg, frequency_hz)).loop


def all_frequencies_hz(period_s: float) -> Array:
    """Return evenly spaced frequencies up to half the sampling rate, (n,)."""
    return np.linspace(0.0, 0.5 / period_s, FREQUENCIES + 2)[1:-1]


def sensitivity_peak(params: AxisParams, mass_kg: float) -> float:
    """Return Ms, the largest |1 / (1 + L)|; infinite where the loop is unstable."""
    plant = rigid_plant(params.period_s, mass_kg, all_frequencies_hz(params.period_s))
    if not is_stable(characteristic_of(params, plant), integrators_of(params)):
        return math.inf
    return float(np.abs(1.0 / (1.0 + coupled_loop_of(params, plant).loop)).max())


def noise_gain_n_m(params: AxisParams, mass_kg: float) -> float:
    """Return the RMS force command per RMS white noise in the measured position, N/m."""
    frequency_hz = all_frequencies_hz(params.period_s)
    loop = open_loop(params, mass_kg, frequency_hz)
    to_force = loop / (1.0 + loop) / rigid_mass(params.period_s, mass_kg, frequency_hz)
    return rms(np.abs(to_force))
