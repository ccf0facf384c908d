"""Stribeck curve and LuGre against the formulas and numbers of the papers."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hil_sim.config import ConfigError, load_plant
from hil_sim.physics.friction import coulomb_friction, presliding_lugre, stribeck_friction, viscous_friction
from hil_sim.plant.layout import AXIS_PARAMS, AXIS_STATE, state_record, write_params
from hil_sim.plant.sliding import slide

IDEAL = Path(__file__).parents[2] / "support" / "ideal_axis.toml"
DT_S = 50e-6
# Xia et al., table II
FS_N, FC_N, VS_M_S, Q_N_S_M = 26.97, 18.92, 0.017, 56.6
COULOMB = coulomb_friction.Params(FC_N)
STRIBECK = stribeck_friction.Params(FS_N - FC_N, VS_M_S)
BRISTLE = presliding_lugre.Params(stiffness_n_m=1e7, bristle_damping_n_s_m=2e3)


def level_n(speed_m_s: float) -> float:
    return coulomb_friction.level_n(COULOMB, speed_m_s) + stribeck_friction.level_n(STRIBECK, speed_m_s)


def equation_8(velocity_m_s: float) -> float:
    bump = (FS_N - FC_N) * math.exp(-((velocity_m_s / VS_M_S) ** 2))
    return (FC_N + bump + Q_N_S_M * abs(velocity_m_s)) * math.copysign(1.0, velocity_m_s)


def test_level_at_rest_at_the_stribeck_speed_and_far_above_it() -> None:
    assert level_n(0.0) == pytest.approx(26.97)
    assert level_n(VS_M_S) == pytest.approx(18.92 + 8.05 / math.e)
    assert level_n(1.0) == 18.92


@pytest.mark.parametrize("velocity_m_s", [-0.2, -0.017, -0.001, 0.0005, 0.01, 0.03])
def test_lugre_settles_on_the_curve_of_equation_8(velocity_m_s: float) -> None:
    s = state_record(presliding_lugre)
    level = level_n(abs(velocity_m_s))
    for _ in range(int(200e-6 / (abs(velocity_m_s) * DT_S)) + 1):
        presliding_lugre.slide(BRISTLE, s, velocity_m_s, level, DT_S)
    bristle_n, damping = presliding_lugre.force_and_damping(BRISTLE, s, velocity_m_s, level)
    viscous = viscous_friction.damping_n_s_m(viscous_friction.Params(Q_N_S_M), velocity_m_s)
    assert bristle_n + (damping + viscous) * velocity_m_s == pytest.approx(equation_8(velocity_m_s), rel=1e-6)


def test_lugre_follows_its_differential_equation_through_a_reversal() -> None:
    """Against scipy on dz/dt = v - sigma0 |v| z / g(v) with a sine of 3 um."""
    amplitude_m, omega = 3e-6, 2.0 * math.pi * 5.0

    def velocity(t: float) -> float:
        return amplitude_m * omega * math.cos(omega * t)

    def bend(t: float, z: list[float]) -> list[float]:
        v = velocity(t)
        return [v - BRISTLE.stiffness_n_m * abs(v) * z[0] / level_n(abs(v))]

    steps = 8000
    solution = solve_ivp(bend, (0.0, steps * DT_S), [0.0], rtol=1e-9, atol=1e-15, max_step=1e-3)
    s = state_record(presliding_lugre)
    for k in range(steps):
        v = velocity((k + 0.5) * DT_S)
        presliding_lugre.slide(BRISTLE, s, v, level_n(abs(v)), DT_S)
    assert s["bristle_m"] == pytest.approx(solution.y[0, -1], rel=1e-5)


def test_lugre_is_a_spring_of_sigma0_for_small_displacements() -> None:
    s = state_record(presliding_lugre)
    for _ in range(10):
        presliding_lugre.slide(BRISTLE, s, 1e-9 / DT_S / 10.0, level_n(0.0), DT_S)  # 1 nm in all
    force, _ = presliding_lugre.force_and_damping(BRISTLE, s, 0.0, level_n(0.0))
    assert force / 1e-9 == pytest.approx(BRISTLE.stiffness_n_m, rel=1e-3)


def test_a_bristle_of_sigma0_1e8_takes_any_step() -> None:
    stiff, s = presliding_lugre.Params(1e8, 0.0), state_record(presliding_lugre)
    presliding_lugre.slide(stiff, s, 5.0, 20.0, DT_S)  # 250 um in one step, 0.2 um of reach
    assert s["bristle_m"] == pytest.approx(20.0 / 1e8)


def test_coulomb_stops_a_body_in_the_time_of_uniform_deceleration_and_holds_it() -> None:
    velocity, steps = 0.01, 0
    while velocity != 0.0:
        velocity = coulomb_friction.stick_or_slide_m_s(velocity, 20.0, 50.0, DT_S)
        steps += 1
    assert steps * DT_S == pytest.approx(0.01 * 50.0 / 20.0, abs=1.01 * DT_S)
    assert coulomb_friction.stick_or_slide_m_s(19.99 * DT_S / 50.0, 20.0, 50.0, DT_S) == 0.0
    assert coulomb_friction.stick_or_slide_m_s(-20.01 * DT_S / 50.0, 20.0, 50.0, DT_S) < 0.0


@pytest.mark.parametrize("dip_n", [-FC_N, -0.4 * FC_N])
def test_friction_that_falls_towards_rest_takes_energy_and_holds_what_it_can(dip_n: float) -> None:
    p, s = np.zeros(1, AXIS_PARAMS)[0], np.zeros(1, AXIS_STATE)[0]
    write_params(p["coulomb_friction"], COULOMB)
    write_params(p["stribeck_friction"], stribeck_friction.Params(dip_n, VS_M_S))
    rest_n, mass_kg = FC_N + dip_n, 20.0
    assert slide(p, s, False, mass_kg, 0.0, 0.99 * rest_n, DT_S) == 0.0
    assert slide(p, s, False, mass_kg, 0.0, 1.01 * rest_n + 0.01, DT_S) > 0.0
    velocity_m_s = -0.05
    while velocity_m_s < -1e-4:  # coasting, it slows down all the way, and is never turned round
        after_m_s = slide(p, s, False, mass_kg, velocity_m_s, 0.0, DT_S)
        assert velocity_m_s < after_m_s <= 0.0
        velocity_m_s = after_m_s


def test_friction_below_zero_at_rest_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "plant.toml"
    friction = "[axis.x.coulomb_friction]\ncoulomb_n = 5.0\n[axis.x.stribeck_friction]\nstribeck_mm_s = 2.0\n"
    for given_n in (-5.0, -5.1):
        text = IDEAL.read_text(encoding="utf-8") + friction + f"stribeck_n = {given_n}\n"
        file.write_text(text, encoding="utf-8")
        if given_n == -5.0:
            assert load_plant(file).axes["x"].effects["stribeck_friction"].stribeck_n == given_n
        else:
            with pytest.raises(ConfigError, match=r"friction at rest would be -0\.1 N"):
                load_plant(file)
