"""Friction of motor and table: a level times a hysteretic variable z (Bouc 1967, Wen 1976).

dz/dx = (1 - |z|^n (u + (1 - u) sgn(z v))) / length: not the exponential of a bristle model.
"""

import math
from typing import NamedTuple

from tests.campaigns.blind.compiled import compiled
from tests.campaigns.blind.nonlinearities import bouc_wen
from tests.campaigns.blind.plant import Plant


class FrictionState(NamedTuple):
    """Hysteretic variables of motor and table, and the age of the contact since it last slid."""

    motor_z: float
    table_z: float
    age_s: float


class Friction(NamedTuple):
    """Friction forces, newtons, and what the levels are made of."""

    motor_n: float
    table_n: float
    stribeck_n: float
    dwell_n: float
    position_n: float
    step_n: float
    quadratic_n: float
    viscous_asymmetry_n: float
    temperature_factor: float


@compiled
def friction(
    p: Plant,
    state: FrictionState,
    motor_m_s: float,
    table_m: float,
    table_m_s: float,
    rise_share: float,
    now_s: float,
    h: float,
) -> tuple[Friction, FrictionState]:
    """Return the friction after a step of `h` seconds at these velocities."""
    v1, v2 = motor_m_s, table_m_s
    age = state.age_s + h * (1.0 - abs(v2) * state.age_s / p.dwell_reset_m)
    age = max(age, 0.0)
    factor = 1.0 - p.temperature_share * rise_share
    stribeck = (
        p.stribeck_n / (1.0 + (abs(v2) / p.stribeck_m_s) ** p.stribeck_exponent)
        if p.stribeck_n != 0.0
        else 0.0
    )
    dwell = p.dwell_n * math.log1p(age / p.dwell_s) if p.dwell_n > 0.0 else 0.0
    position = (
        p.position_friction_n * math.tanh((table_m - p.position_friction_at_m) / p.position_friction_width_m)
        if p.position_friction_n != 0.0
        else 0.0
    )
    step = p.friction_step_n if now_s >= p.friction_step_at_s else 0.0
    z2 = bouc_wen(state.table_z, h * v2 / p.presliding_m, p.sharpness, p.unloading)
    level = max((p.coulomb_n + stribeck + position + step) * factor + dwell, 0.0)
    rigid = p.has_compliance == 0.0
    z1 = z2 if rigid else bouc_wen(state.motor_z, h * v1 / p.presliding_m, p.sharpness, p.unloading)
    motor = p.nut_share * ((level + p.coulomb_asymmetry_n * z1) * z1 + factor * p.viscous_n_s_m * v1)
    table = (1.0 - p.nut_share) * ((level + p.coulomb_asymmetry_n * z2) * z2 + factor * p.viscous_n_s_m * v2)
    quadratic = (
        p.quadratic * abs(v2) ** p.quadratic_exponent * (1.0 if v2 > 0.0 else -1.0)
        if p.quadratic > 0.0
        else 0.0
    )
    viscous_asymmetry = p.viscous_asymmetry_n_s_m * abs(v2)
    table += quadratic + viscous_asymmetry
    of_parts = Friction(motor, table, stribeck, dwell, position, step, quadratic, viscous_asymmetry, factor)
    return of_parts, FrictionState(z1, z2, age)
