"""Compliance of the drive: scale less motor in proportion to the transmitted force.

Where the motor alone is measured: the antiresonance and resonance of a load on a spring.
"""

import math

import numpy as np

from hil_sim.physics.transmission import drive_compliance as physics
from kernels.arrays import Array
from reconcile.catalogue import backlash, spring_behind_motor
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import POSITIVE, CatalogueEntry, IndicatorKind, PlausibleTerm, Rival
from reconcile.catalogue.kinds import (
    RegressionData,
    ResidualChannel,
    ShapeParameters,
    SiParameter,
    TermFamily,
)

CONTACT_N_M, CONTACT_DAMPING_RATIO = 2e8, 0.05
"""Contact of a backlash without an identified compliance in an updated model: too stiff to show; chosen."""
SOFT_N_M = 1e5
"""Stiffness below which sentences use N/m, as for small rotary joints."""
SYSTEMATIC = {"compliance_m_n": (0.0, 1.5), "stiffness_n_m": (0.6, 0.0)}
"""Friction in front of the spring (nut, bearings) is not transmitted: up to 60 % of it may act there."""


def _columns(data: RegressionData, _shape: ShapeParameters) -> Array:
    # the rotor's inertia force is not transmitted; where it is not known it has a column of its own
    acceleration = data.motion.acceleration_m_s2
    if data.motor_mass_kg > 0.0:
        return (data.motor_mass_kg * acceleration - data.force_n)[:, None]
    return np.stack((-data.force_n, acceleration), axis=1)


def _force_columns(data: RegressionData, shape: ShapeParameters) -> Array:
    return spring_behind_motor.column(data.motion.position_m, data.period_s, *shape)[:, None]


def _parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, SiParameter]:
    if shape:
        return _from_the_motor(shape[0], shape[1], float(coefficients[0]))
    compliance_m_n = float(coefficients[0])
    return {
        "compliance_m_n": SiParameter(compliance_m_n, "m/N"),
        "stiffness_n_m": SiParameter(1.0 / compliance_m_n, "N/m"),
    }


def _from_the_motor(frequency_hz: float, ratio: float, load_kg: float) -> dict[str, SiParameter]:
    w = 2.0 * math.pi * frequency_hz
    return {
        "stiffness_n_m": SiParameter(load_kg * w**2, "N/m"),
        "damping_n_s_m": SiParameter(2.0 * ratio * load_kg * w, "N s/m"),
        "load_mass_kg": SiParameter(load_kg, "kg"),
        "antiresonance_hz": SiParameter(frequency_hz, "Hz"),
    }


def _sentence(p: dict[str, float]) -> str:
    if "antiresonance_hz" in p:
        return (
            f"the motor feels {p['load_mass_kg']:.4g} kg on a spring of {_stiffness(p['stiffness_n_m'])}"
            f": at {p['antiresonance_hz']:.1f} Hz the load takes all the force and the motor stands, "
            "above it they resonate against each other; a filter or a delay would have no such pair"
        )
    least = (1.0 - SYSTEMATIC["stiffness_n_m"][0]) * p["stiffness_n_m"]
    return (
        f"the scale lags the motor by {p['compliance_m_n'] * 1e6:.4f} um per newton of force (stiffness "
        f"{_stiffness(p['stiffness_n_m'])}, or down to {_stiffness(least)} where friction acts in front "
        "of the spring): compliance of the drive; backlash would step whatever the force"
    )


def _stiffness(stiffness_n_m: float) -> str:
    return f"{stiffness_n_m * 1e-6:.3g} N/um" if stiffness_n_m >= SOFT_N_M else f"{stiffness_n_m:.4g} N/m"


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    """Nothing for the contact that an updated model gives to a backlash."""
    if backlash.ENTRY.name in of.effects and math.isclose(_damping_ratio(of), CONTACT_DAMPING_RATIO):
        return []
    load_kg = of.base["mass_kg"] - of.axis.motor_mass_kg
    terms = []
    if of.axis.motor_mass_kg > 0.0 and load_kg > 0.0:
        w = math.sqrt(of.params.stiffness_n_m / load_kg)
        shape = w / (2.0 * math.pi), of.params.damping_n_s_m / (2.0 * load_kg * w)
        if shape[0] <= spring_behind_motor.highest_hz(of.datasets):
            terms.append(ModelTerm(of.effect, shape, (load_kg,)))
    # the column of the rotor's inertia force, where its mass is not known
    rotor = () if of.datasets[0].motor_mass_kg > 0.0 else (0.0,)
    coefficients = (1.0 / of.params.stiffness_n_m, *rotor)
    return [*terms, ModelTerm(of.effect, (), coefficients, ResidualChannel.POSITION_DEVIATION)]


def _damping_ratio(of: ModelEffect) -> float:
    p, motor_kg = of.params, of.axis.motor_mass_kg
    reduced_kg = motor_kg * (1.0 - motor_kg / of.base["mass_kg"])
    return float(p.damping_n_s_m / (2.0 * math.sqrt(p.stiffness_n_m * reduced_kg))) if reduced_kg > 0 else 0.0


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(
        TermFamily(_force_columns, spring_behind_motor.shapes, if_excited=True),
        TermFamily(_columns, channel=ResidualChannel.POSITION_DEVIATION),
    ),
    parameters_of=_parameters,
    sentence=_sentence,
    physical=POSITIVE,
    systematic=SYSTEMATIC,
    indicators=(
        IndicatorKind(
            name="compliance_m_n",
            unit="m/N",
            words="compliance of the drive",
            channel=ResidualChannel.POSITION_DEVIATION,
        ),
    ),
    to_plant=lambda found, _notes: {
        key: found.terms[0][key] for key in ("stiffness_n_m", "damping_n_s_m") if key in found.terms[0]
    },
    from_plant=_from_plant,
    rivals=(
        Rival("backlash"),
        Rival("current_loop_lag", "a compliance shows on the scale and resonates; a lag stays in the force"),
        Rival(
            "transport_delay",
            "a compliance grows with the square of the frequency, a delay in proportion to it",
        ),
    ),
    shown_by="the scale lags in proportion to the force",
    experiment="scale",
    plausible=lambda _sizes: [PlausibleTerm((), (1e-8,), ResidualChannel.POSITION_DEVIATION)],
    rank=18,
)
