"""Linear dynamics behind the motion that no entry of the catalogue has: ringing and relaxation.

Ringing is a mass that hangs on the axis by a spring (a tank, a cable, a machine bed): excited by the table's
acceleration, it pulls with its own frequency. Dying away is a spring in series with a damper (a hose, a
cover, an elastomer), Maxwell's element: excited by the velocity.
"""

import math

import numpy as np
from scipy.signal import lfilter

from kernels.arrays import Array
from reconcile.catalogue.kinds import Parameter, RegressionData, ShapeParameters, UnnamedTerm

DAMPING = 0.06
"""Damping ratio of the resonators: each covers a tenth of its frequency to either side."""
FREQUENCIES_HZ = tuple(float(f) for f in np.geomspace(4.0, 50.0, 20))
TIMES_S = (0.03, 0.06, 0.12, 0.25, 0.5, 1.0)


def _ringing(data: RegressionData, shape: ShapeParameters) -> Array:
    """Response in phase and in quadrature, per kg, (n, 2); exact for a linear course between samples."""
    w = 2.0 * math.pi * shape[0]
    pole = np.exp(data.period_s * complex(-DAMPING * w, w * math.sqrt(1.0 - DAMPING**2)))
    # a complex pole of unit gain at zero frequency; its real and imaginary parts span the responses
    response = lfilter([1.0 - pole], [1.0, -pole], data.motion.acceleration_m_s2.astype(complex))
    return np.stack((response.real, response.imag), axis=1)


def _lagging_velocity(data: RegressionData, shape: ShapeParameters) -> Array:
    pole = math.exp(-data.period_s / shape[0])
    return lfilter([1.0 - pole], [1.0, -pole], data.motion.velocity_m_s)[:, None]


RINGING = UnnamedTerm(
    shapes=lambda _datasets: [(f,) for f in FREQUENCIES_HZ],
    columns=_ringing,
    parameters=lambda shape, coefficients: {
        "frequency_hz": Parameter(shape[0], "Hz"),
        "mass_kg": Parameter(float(np.hypot(*coefficients)), "kg"),
    },
    finding=lambda p: (
        f"after an acceleration the axis is pulled to and fro at {p['frequency_hz']:.1f} Hz, as by "
        f"{p['mass_kg']:.2g} kg on a spring"
    ),
)
"""A resonator driven by the acceleration."""
RELAXATION = UnnamedTerm(
    shapes=lambda _datasets: [(t,) for t in TIMES_S],
    columns=_lagging_velocity,
    parameters=lambda shape, coefficients: {
        "time_s": Parameter(shape[0], "s"),
        "late_viscous_n_s_m": Parameter(float(coefficients[0]), "N s/m"),
    },
    finding=lambda p: (
        f"part of the force follows the speed {p['time_s']:.2g} s late, {p['late_viscous_n_s_m']:.3g} N "
        "s/m of it: it relaxes"
    ),
)
"""A first-order lag driven by the velocity."""
