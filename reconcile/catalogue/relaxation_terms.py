"""Linear dynamics behind the motion that no entry of the catalogue has: ringing and relaxation.

Ringing is a mass that hangs on the axis by a spring (a tank, a cable, a machine bed): excited by the table's
acceleration, it pulls at its own frequency. Relaxation is a spring in series with a damper (a hose, a cover,
an elastomer), Maxwell's element: excited by the velocity.
"""

import math
from collections.abc import Mapping

import numpy as np
from scipy.signal import lfilter

from hil_sim.physics.load import relaxation, structural_mode
from kernels.arrays import Array
from kernels.quantities import section_of
from reconcile.catalogue.conversion import NotInAPlant, PlantValues
from reconcile.catalogue.kinds import RegressionData, ShapeParameters, SiParameter, UnnamedTerm
from reconcile.catalogue.smooth_terms import PREFIX

RINGING_EFFECT = PREFIX + "ringing"
"""Effect of a candidate that rings."""
RESONATOR_DAMPING_RATIO = 0.06
"""Each resonator covers a tenth of its frequency to either side."""
LEAST_IN_PHASE = 0.7
"""Share of the response in phase, which a carried mass has wholly but for its damping; chosen."""
FREQUENCIES_HZ = tuple(float(f) for f in np.geomspace(4.0, 50.0, 20))
"""To scan, 14 % apart: the resonators cover all between. Below, gravity and friction look like springs."""
TIMES_S = (0.03, 0.06, 0.12, 0.25, 0.5, 1.0)
"""Time constants to scan, a factor of two apart."""


def _ringing(data: RegressionData, shape: ShapeParameters) -> Array:
    """Response in phase and in quadrature, per kg, (n, 2); exact for a linear course between samples.

    A second shape parameter is the damping ratio of a plant's mode; then the acceleration itself is a third
    column, for the mass that a model's baseline has.
    """
    w, damping = 2.0 * math.pi * shape[0], shape[1] if len(shape) > 1 else RESONATOR_DAMPING_RATIO
    pole = np.exp(data.period_s * complex(-damping * w, w * math.sqrt(1.0 - damping**2)))
    # a complex pole of unit gain at zero frequency; its real and imaginary parts span the responses
    acceleration = data.motion.acceleration_m_s2
    response = lfilter([1.0 - pole], [1.0, -pole], acceleration.astype(complex))
    parts = (response.real, response.imag)
    return np.stack(parts if len(shape) < 2 else (*parts, acceleration), axis=1)


def _lagging_velocity(data: RegressionData, shape: ShapeParameters) -> Array:
    pole = math.exp(-data.period_s / shape[0])
    return lfilter([1.0 - pole], [1.0, -pole], data.motion.velocity_m_s)[:, None]


def _carried_mass(p: Mapping[str, float]) -> PlantValues:
    if p["in_phase_kg"] < LEAST_IN_PHASE * p["mass_kg"]:
        raise NotInAPlant("what rings follows the acceleration otherwise than a carried mass does")
    return {
        "mass_kg": p["in_phase_kg"],
        "frequency_hz": p["frequency_hz"],
        "damping_ratio": RESONATOR_DAMPING_RATIO,
    }


RINGING = UnnamedTerm(
    shapes=lambda _datasets: [(f,) for f in FREQUENCIES_HZ],
    columns=_ringing,
    parameters=lambda shape, coefficients: {
        "frequency_hz": SiParameter(shape[0], "Hz"),
        "mass_kg": SiParameter(float(np.hypot(*coefficients)), "kg"),
        "in_phase_kg": SiParameter(float(coefficients[0]), "kg"),
    },
    finding=lambda p: (
        f"after an acceleration the axis is pulled to and fro at {p['frequency_hz']:.1f} Hz, as by "
        f"{p['mass_kg']:.2g} kg on a spring"
    ),
    section=section_of(structural_mode),
    to_plant=_carried_mass,
)
"""A resonator driven by the acceleration."""
RELAXATION = UnnamedTerm(
    shapes=lambda _datasets: [(t,) for t in TIMES_S],
    columns=_lagging_velocity,
    parameters=lambda shape, coefficients: {
        "time_s": SiParameter(shape[0], "s"),
        "late_viscous_n_s_m": SiParameter(float(coefficients[0]), "N s/m"),
    },
    finding=lambda p: (
        f"part of the force follows the speed {p['time_s']:.2g} s late, {p['late_viscous_n_s_m']:.3g} N "
        "s/m of it: it relaxes"
    ),
    section=section_of(relaxation),
    to_plant=lambda p: {"damping_n_s_m": p["late_viscous_n_s_m"], "time_s": p["time_s"]},
)
"""A first-order lag driven by the velocity."""
