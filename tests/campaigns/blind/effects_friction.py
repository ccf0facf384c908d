"""Draw concealed friction: its size, as parameters of the plant."""

import math

from tests.campaigns.blind.case import Planted
from tests.campaigns.blind.plant import Plant
from tests.campaigns.blind.setting import Drawn, Setting, sign


def asymmetric_coulomb(p: Plant, s: Setting) -> Drawn:
    half_n = s.rng.uniform(0.12, 0.35) * p.coulomb_n * sign(s.rng)
    truth = Planted(
        "asymmetric_coulomb_friction", {"force_n": -half_n}, ("coulomb_asymmetry",), alike=("constant_force",)
    )
    return p._replace(coulomb_asymmetry_n=half_n), truth


def asymmetric_viscous(p: Plant, s: Setting) -> Drawn:
    half = s.rng.uniform(0.2, 0.45) * p.viscous_n_s_m * sign(s.rng)
    truth = Planted("asymmetric_viscous_friction", {"half_difference_n_s_m": half}, ("viscous_asymmetry",))
    return p._replace(viscous_asymmetry_n_s_m=half), truth


def stribeck(p: Plant, s: Setting) -> Drawn:
    rise_n = s.rng.uniform(0.3, 0.8) * p.coulomb_n
    speed_m_s = math.exp(s.rng.uniform(math.log(1.5e-3), math.log(15e-3)))
    plant = p._replace(stribeck_n=rise_n, stribeck_m_s=speed_m_s, stribeck_exponent=s.rng.uniform(1.6, 2.4))
    return plant, Planted("stribeck_friction", {}, ("stribeck",))


def quadratic_viscous(p: Plant, s: Setting) -> Drawn:
    power = s.rng.uniform(1.8, 2.2)
    drag = s.rng.uniform(0.5, 1.2) * p.coulomb_n / s.reach.velocity_m_s**power
    return p._replace(quadratic=drag, quadratic_exponent=power), Planted(
        "quadratic_viscous_friction", {}, ("quadratic",)
    )


def presliding(p: Plant, s: Setting) -> Drawn:
    presliding_m = math.exp(s.rng.uniform(math.log(12e-6), math.log(80e-6)))
    plant = p._replace(
        presliding_m=presliding_m, sharpness=s.rng.uniform(1.3, 3.0), unloading=s.rng.uniform(0.35, 0.6)
    )
    return plant, Planted("presliding_hysteresis", {}, ("presliding",))


def dwell(p: Plant, s: Setting) -> Drawn:
    age_s, after_s = s.rng.uniform(0.2, 0.8), 3.0
    age_n = s.rng.uniform(0.3, 0.8) * p.coulomb_n / math.log1p(after_s / age_s)
    plant = p._replace(dwell_n=age_n, dwell_s=age_s, dwell_reset_m=s.rng.uniform(1e-5, 5e-5))
    return plant, Planted("dwell_dependent_breakaway", {}, ("dwell",))


def position_dependent(p: Plant, s: Setting) -> Drawn:
    half_m = 0.5 * s.reach.travel_m
    plant = p._replace(
        position_friction_n=s.rng.uniform(0.15, 0.4) * p.coulomb_n * sign(s.rng),
        position_friction_at_m=s.rng.uniform(-0.3, 0.3) * half_m,
        position_friction_width_m=s.rng.uniform(0.3, 1.0) * half_m,
    )
    return plant, Planted("position_dependent_friction", {}, ("position_friction",))


def temperature_dependent(p: Plant, s: Setting) -> Drawn:
    return p._replace(temperature_share=s.rng.uniform(0.15, 0.4)), Planted(
        "temperature_dependent_friction", {}, ("temperature",)
    )
