"""The fuzzy table is Table II of Xia et al. as read in docs/decisions/0011, and reproduces figure 6."""

import math
from pathlib import Path

import numpy as np
import pytest

from hil_sim.config import build_plant, load_plant
from hil_sim.plant import amplifier
from hil_sim.plant.integrate import advance

CONFIG = load_plant(Path(__file__).parents[3] / "machines" / "fuzzy_table")
AXIS = CONFIG.axes["x"]
KBS_M_RAD = AXIS.lead_m / (2.0 * math.pi)
KT, R, L = 0.82, 1.04, AXIS.effects["winding"].inductance_h
J = AXIS.motor_mass_kg * KBS_M_RAD**2
KCP = AXIS.amplifier.current_gain_v_a
KVP = AXIS.amplifier.velocity_gain_n_s_m * KBS_M_RAD**2 / KT


def test_what_is_legible_and_sound_is_as_printed() -> None:
    effects = AXIS.effects
    assert round(KBS_M_RAD * 1e3, 2) == 1.59
    assert AXIS.motor.torque_constant_nm_a == KT
    assert effects["winding"].resistance_v_a == R
    assert AXIS.table.mass_kg == 48.8
    assert effects["drive_compliance"] == pytest.approx((0.4e6, 15e3))
    assert effects["coulomb_friction"].coulomb_n == 18.92
    assert effects["coulomb_friction"].coulomb_n + effects["stribeck_friction"].stribeck_n == pytest.approx(
        26.97
    )
    assert effects["stribeck_friction"].stribeck_m_s == pytest.approx(0.017)
    assert effects["viscous_friction"].viscous_n_s_m == 56.6
    assert effects["backlash"].play_m == pytest.approx(0.002e-3)


def test_what_was_changed_was_changed_by_powers_of_ten() -> None:
    assert pytest.approx((2.99e-3, 5.27e-3, 20.0, 4.5), rel=1e-4) == (J, L, KCP, KVP)
    assert pytest.approx(45.0 * 2.0, rel=1e-4) == KVP * KCP
    assert AXIS.amplifier.velocity_integral_n_m == 0.0


def test_loops_of_equation_3_are_a_cascade_and_damped() -> None:
    inner_1_s = (KCP + R) / L
    outer_1_s = KVP * KT / J
    assert inner_1_s > 3.0 * outer_1_s
    poles = np.roots([J * L, J * (KCP + R), KT * (KCP * KVP + KT)])
    assert np.abs(poles) / (2.0 * math.pi) == pytest.approx(346.0, rel=0.01)
    assert -poles.real / np.abs(poles) == pytest.approx(0.92, abs=0.01)


def test_velocity_step_is_that_of_figure_6() -> None:
    """The table stands until the force reaches the static friction; the force ends at the friction."""
    plant = build_plant(CONFIG)
    plant.setpoint["loop"] = amplifier.VELOCITY
    plant.setpoint["velocity_m_s"] = 0.01
    force, speed = [], []
    for _ in range(4000):
        advance(*plant, 1, CONFIG.dt_s)
        force.append(float(plant.state["transmitted_n"][0]))
        speed.append(float(plant.state["table_velocity_m_s"][0]))
    starts = int(np.nonzero(speed)[0][0])
    assert starts > 10
    assert max(force[: starts - 1]) <= 26.97 < force[starts]
    assert max(force) > 2.0 * 26.97
    friction_n = 18.92 + 8.05 * math.exp(-((speed[-1] / 0.017) ** 2)) + 56.6 * speed[-1]
    assert force[-1] == pytest.approx(friction_n, rel=0.02)
    assert speed[-1] == pytest.approx(0.01 * KCP * KVP / (KCP * KVP + KT), rel=0.005)
    assert max(speed) < 1.01 * speed[-1]
