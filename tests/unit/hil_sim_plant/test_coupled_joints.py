"""Two joints that move each other, against a double pendulum by its mass matrix in scipy, and its energy."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hil_sim.config import Plant, load_plant
from hil_sim.config.load import ConfigError
from hil_sim.physics.load import constant_force, gravity, gravity_of_outer_link, joint_coupling
from hil_sim.plant import amplifier
from hil_sim.plant.integrate import advance
from hil_sim.plant.layout import AXIS_PARAMS, SETPOINT, Mechanics, power_up, write_params

DT_S = 50e-6
G_M_S2 = 9.81
LINK_1_KG, LINK_2_KG, LENGTH_1_M, CENTRE_1_M, CENTRE_2_M = 0.7, 0.6, 0.3, 0.2, 0.15
INERTIA_1, INERTIA_2 = 0.06, 0.03
"""Of each link about its own joint, kg m^2."""
ARM = LINK_2_KG * LENGTH_1_M * CENTRE_2_M
MASSES = (INERTIA_1 + INERTIA_2 + LINK_2_KG * LENGTH_1_M**2, INERTIA_2)
"""Of the joints, without what turns with the outer one."""
START_RAD = (1.2, 0.7)


def pair(effects: tuple[dict[str, Any], dict[str, Any]], starts_m: tuple[float, float]) -> Plant:
    params = np.zeros(2, AXIS_PARAMS)
    for record, mass, start_m, own in zip(params, MASSES, starts_m, effects, strict=True):
        write_params(record["mechanics"], Mechanics(2.0 * math.pi, 0.0, mass, 1.0, start_m))
        for name, values in own.items():
            write_params(record[name], values)
    return Plant(params, power_up(params), np.zeros(2, SETPOINT))


def double_pendulum() -> Plant:
    coupling = joint_coupling.Params(other=1.0, outer=0.0, inertia_kg=INERTIA_2, arm_kg=ARM)
    outer = gravity_of_outer_link.Params(other=1.0, amplitude_n=-LINK_2_KG * G_M_S2 * CENTRE_2_M)
    inner_n = -G_M_S2 * (LINK_1_KG * CENTRE_1_M + LINK_2_KG * LENGTH_1_M)
    first = {
        "joint_coupling": coupling,
        "gravity": gravity.Params(amplitude_n=inner_n, phase_rad=0.0),
        "gravity_of_outer_link": outer,
    }
    second = {
        "joint_coupling": coupling._replace(other=0.0, outer=1.0),
        "gravity_of_outer_link": outer._replace(other=0.0),
    }
    return pair((first, second), START_RAD)


def swing(plant: Plant, seconds: float) -> tuple[Any, Any]:
    """Positions and velocities (2, n) after every tenth substep."""
    rows = []
    for _ in range(round(seconds / DT_S / 10)):
        advance(*plant, 10, DT_S)
        rows.append((plant.state["table_position_m"].copy(), plant.state["table_velocity_m_s"].copy()))
    positions, velocities = zip(*rows, strict=True)
    return np.array(positions).T, np.array(velocities).T


def test_the_pendulum_swings_as_its_mass_matrix_says() -> None:
    """The equations of the two absolute angles, which share none with the effects."""

    def motion(_t: float, y: Any) -> list[float]:
        a, b, va, vb = y  # absolute angles of the links
        coupled = ARM * math.cos(a - b)
        mass = np.array([[INERTIA_1 + LINK_2_KG * LENGTH_1_M**2, coupled], [coupled, INERTIA_2]])
        turning = ARM * math.sin(a - b)
        weight_1 = G_M_S2 * (LINK_1_KG * CENTRE_1_M + LINK_2_KG * LENGTH_1_M) * math.sin(a)
        weight_2 = G_M_S2 * LINK_2_KG * CENTRE_2_M * math.sin(b)
        force = np.array([-turning * vb**2 - weight_1, turning * va**2 - weight_2])
        return [va, vb, *np.linalg.solve(mass, force)]

    q, _ = swing(double_pendulum(), 1.0)
    times = (np.arange(q.shape[1]) + 1) * 10 * DT_S
    start = [START_RAD[0], START_RAD[0] + START_RAD[1], 0.0, 0.0]
    truth = solve_ivp(motion, (0.0, 1.0), start, t_eval=times, rtol=1e-10, atol=1e-12).y
    assert np.abs(truth[:2]).max() > 1.0
    assert np.abs(q[0] - truth[0]).max() < 5e-3
    assert np.abs(q[0] + q[1] - truth[1]).max() < 5e-3


def test_the_pendulum_keeps_its_energy() -> None:
    (q1, q2), (v1, v2) = swing(double_pendulum(), 3.0)
    kinetic = (
        0.5 * (MASSES[0] + 2.0 * ARM * np.cos(q2)) * v1**2
        + 0.5 * MASSES[1] * v2**2
        + (INERTIA_2 + ARM * np.cos(q2)) * v1 * v2
    )
    potential = -G_M_S2 * (
        (LINK_1_KG * CENTRE_1_M + LINK_2_KG * LENGTH_1_M) * np.cos(q1)
        + LINK_2_KG * CENTRE_2_M * np.cos(q1 + q2)
    )
    energy = kinetic + potential
    assert np.ptp(energy) < 0.01 * np.ptp(kinetic)


def test_two_motors_on_one_body_move_by_newton() -> None:
    """Without an arm the masses are a constant matrix."""
    coupled = 0.02
    own = joint_coupling.Params(other=1.0, outer=0.0, inertia_kg=coupled)
    effects = (
        {"joint_coupling": own, "constant_force": constant_force.Params(force_n=0.5)},
        {"joint_coupling": own._replace(other=0.0)},
    )
    plant = pair(effects, (0.0, 0.0))
    _, velocities = swing(plant, 0.5)
    mass = np.array([[MASSES[0], coupled], [coupled, MASSES[1]]])
    assert velocities[:, -1] == pytest.approx(0.5 * np.linalg.solve(mass, [0.5, 0.0]), rel=1e-3)


def test_the_motion_is_equal_however_the_calls_are_cut() -> None:
    whole, cut = double_pendulum(), double_pendulum()
    for plant in (whole, cut):
        plant.setpoint["loop"] = amplifier.OFF
    advance(*whole, 20, DT_S)
    for _ in range(20):
        advance(*cut, 1, DT_S)
    for name in ("table_position_m", "table_velocity_m_s", "friction_n"):
        assert np.array_equal(whole.state[name], cut.state[name])


def test_a_coupling_that_no_bodies_have_is_refused(tmp_path: Path) -> None:
    text = (Path(__file__).parents[3] / "machines" / "xy_table" / "plant.toml").read_text(encoding="utf-8")
    coupling = '\n[axis.x.joint_coupling]\nother_axis = "y"\nouter = 1.0\ninertia_kg = 1e5\n'
    eds = (Path(__file__).parents[3] / "eds").as_posix()
    (tmp_path / "plant.toml").write_text(text.replace("../../eds", eds) + coupling, encoding="utf-8")
    with pytest.raises(ConfigError, match=r"joint_coupling.*kinetic energy"):
        load_plant(tmp_path / "plant.toml")
