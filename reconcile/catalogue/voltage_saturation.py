"""Voltage saturation: u <= Umax - Ke |v|, so at speed the drive gives less force than is asked for.

What is asked for beyond the limit is no function of the motion, and the recorded force (or its command, which
a controller makes of the same disturbances) would explain itself. So the candidate is how far the model's
force goes beyond a limit; its coefficient is how much more is asked for than arrives there.
"""

from collections.abc import Sequence

import numpy as np

from hil_sim.physics.motor import voltage_saturation as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import IdentifiedTerms, ModelEffect, ModelTerm, PlantValues
from reconcile.catalogue.entry import POSITIVE, CatalogueEntry, PlausibleTerm
from reconcile.catalogue.kinds import Parameter, RegressionData, ShapeParameters, TermFamily

STALL_SHARES = (0.7, 1.0, 1.4, 2.0, 3.0, 5.0)
"""Force at standstill, in the strongest force of the recordings."""
SPEED_SHARES = (0.8, 1.05, 1.3, 1.7, 2.5)
"""Speed without load, in the highest speed of the recordings."""
LEAST_CHANGE = 0.1
"""Standard deviation of the speed, in its maximum; at one speed only a limit of the force could be seen."""


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    """Force at standstill, N, and speed without load, m/s."""
    speeds_m_s = np.abs(np.concatenate([data.motion.velocity_m_s for data in datasets]))
    if float(speeds_m_s.std()) < LEAST_CHANGE * float(speeds_m_s.max()):
        return []
    strongest_n = max(float(np.percentile(np.abs(data.model_force_n), 99.9)) for data in datasets)
    fastest_m_s = float(speeds_m_s.max())
    if strongest_n == 0.0:
        return []
    return [(f * strongest_n, v * fastest_m_s) for f in STALL_SHARES for v in SPEED_SHARES]


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    stall_n, free_m_s = shape
    v, force_n = data.motion.velocity_m_s, data.model_force_n
    available_n = np.maximum(stall_n * (1.0 - np.abs(v) / free_m_s), 0.0)
    driving = force_n * v > 0.0  # when it brakes, the back EMF helps
    missing_n: Array = np.sign(force_n) * np.maximum(np.abs(force_n) - available_n, 0.0) * driving
    return missing_n[:, None]


def _parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, Parameter]:
    return {
        "stall_n": Parameter(shape[0], "N"),
        "free_m_s": Parameter(shape[1], "m/s"),
        "missing": Parameter(float(coefficients[0]), ""),
    }


def _to_plant(found: IdentifiedTerms, _notes: list[str]) -> PlantValues:
    """Stall force Kf Umax / R and speed without load Umax / Kf; Kf is the back-EMF constant too."""
    term, constant_n_a = found.terms[0], found.axis.force_constant_n_a
    limit_v = term["free_m_s"] * constant_n_a
    return {"voltage_limit_v": limit_v, "resistance_v_a": constant_n_a * limit_v / term["stall_n"]}


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    """All of the excess is missing."""
    p, constant_n_a = of.params, of.axis.force_constant_n_a
    stall_n, free_m_s = constant_n_a * p.voltage_limit_v / p.resistance_v_a, p.voltage_limit_v / constant_n_a
    return [ModelTerm(of.effect, (stall_n, free_m_s), (1.0,))]


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(_columns, _shapes),),
    parameters_of=_parameters,
    sentence=lambda p: (
        f"where force and speed are high together, what is asked for beyond {p['stall_n']:.0f} N less "
        f"{p['stall_n'] / p['free_m_s']:.0f} N per m/s is missing: the amplifier runs out of voltage; a "
        "saturating torque constant would lose it at low speed too"
    ),
    physical=POSITIVE,  # less arrives than is asked for
    continuous_shape_parameters=2,
    to_plant=_to_plant,
    from_plant=_from_plant,
    shown_by="force is missing only at high speed",
    plausible=lambda sizes: [PlausibleTerm((1.05 * sizes.peak_n, 1.6 * sizes.fastest_m_s), (1.0,))],
    rank=14,
)
