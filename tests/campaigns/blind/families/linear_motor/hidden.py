"""What a linear motor's axis may conceal: for each name how its slide differs, and the truth."""

import math

import numpy as np

from tests.campaigns.blind.families.interface import Effect
from tests.campaigns.blind.families.linear_motor.slide import Slide

COMMAND_ONLY = ("current_loop_lag", "transport_delay", "amplifier_dead_zone")
"""Between command and current: seen only where the command is recorded as the force."""
LOOK_ALIKE = {
    "constant_force": "asymmetric_coulomb_friction",
    "asymmetric_coulomb_friction": "constant_force",
}
EXCLUSIVE = [
    frozenset({"asymmetric_coulomb_friction", "constant_force"}),
    frozenset({"current_loop_lag", "transport_delay"}),
    frozenset({"stribeck_friction", "dwell_dependent_breakaway"}),
    frozenset({"cogging", "torque_ripple"}),
]
NAMES = (
    "stribeck_friction", "dwell_dependent_breakaway", "asymmetric_coulomb_friction",
    "quadratic_viscous_friction",
    "position_dependent_friction", "position_dependent_force", "constant_force", "cogging", "torque_ripple",
    "torque_constant_saturation", "periodic_disturbance", *COMMAND_ONLY,
)  # fmt: skip


def sizes(
    base: Slide, rng: np.random.Generator, travel: float, fastest: float, peak_n: float
) -> dict[str, dict[str, float]]:
    """Return by name the fields of the slide that make the effect; all are drawn, whichever are used."""
    c, sign = base.coulomb_n, np.where(rng.random(8) < 0.5, -1.0, 1.0)
    return {
        "stribeck_friction": {"extra_n": rng.uniform(0.4, 1.0) * c, "fall_m_s": rng.uniform(0.002, 0.02)},
        "dwell_dependent_breakaway": {
            "ageing_n": rng.uniform(0.3, 0.7) * c, "young_s": rng.uniform(0.05, 0.3),
            "fall_m_s": rng.uniform(0.002, 0.02),
        },
        "asymmetric_coulomb_friction": {"forward_n": sign[0] * rng.uniform(0.15, 0.4) * c},
        "quadratic_viscous_friction": {"drag": rng.uniform(0.4, 1.5) * c / fastest**2},
        "position_dependent_friction": {
            "dust": sign[1] * rng.uniform(0.2, 0.5), "dust_m": travel * rng.uniform(0.15, 0.5),
        },
        "position_dependent_force": {
            "hose_n": sign[2] * rng.uniform(0.4, 1.2) * c, "hose_m": travel * rng.uniform(0.15, 0.6),
        },
        "constant_force": {"tilt_n": sign[3] * rng.uniform(0.3, 1.5) * c},
        "cogging": {"teeth_n": rng.uniform(0.2, 0.8) * c, "teeth": float(rng.choice([1, 2, 3, 6]))},
        "torque_ripple": {"ripple": rng.uniform(0.03, 0.1), "ripples": float(rng.choice([1, 2, 6]))},
        "torque_constant_saturation": {"iron_n": peak_n / rng.uniform(0.5, 0.9)},
        "periodic_disturbance": {
            "pump_n": rng.uniform(0.15, 0.5) * c, "pump_hz": math.exp(rng.uniform(1.0, 3.3)),
        },
        "current_loop_lag": {"slow_s": rng.uniform(1.5e-3, 5e-3)},
        "transport_delay": {"late": int(rng.integers(4, 12))},
        "amplifier_dead_zone": {"dead_n": rng.uniform(0.15, 0.5) * c},
    }  # fmt: skip


def effect(name: str, fields: dict[str, float], period_s: float) -> Effect:
    """Return the truth of an effect by the fields that make it."""
    f = fields
    parameters: dict[str, float] = {}
    if name == "cogging":
        parameters = {"harmonic": f["teeth"], "amplitude": f["teeth_n"]}
    if name == "torque_ripple":
        parameters = {"harmonic": f["ripples"], "amplitude": f["ripple"]}
    if name == "periodic_disturbance":
        parameters = {"frequency_hz": f["pump_hz"], "amplitude": f["pump_n"]}
    if name in {"current_loop_lag", "transport_delay"}:
        parameters = {"time_s": f.get("slow_s", 0.0) or f["late"] * period_s}
    single = {
        "asymmetric_coulomb_friction": ("force_n", -f.get("forward_n", 0.0)),
        "constant_force": ("force_n", f.get("tilt_n", 0.0)),
        "quadratic_viscous_friction": ("quadratic_n_s2_m2", f.get("drag", 0.0)),
        "amplifier_dead_zone": ("threshold_n", f.get("dead_n", 0.0)),
    }
    if name in single:
        parameters = dict([single[name]])
    alike = (LOOK_ALIKE[name],) if name in LOOK_ALIKE else ()
    return Effect(
        name, parameters, alike=alike, also=("constant_force",) if name == "position_dependent_force" else ()
    )
