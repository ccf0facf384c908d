"""One and two masses against scipy, closed forms and the energy balance."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hil_sim.physics.friction import coulomb_friction, presliding_gms, presliding_lugre, viscous_friction
from hil_sim.physics.load import constant_force
from hil_sim.physics.transmission import backlash, drive_compliance, lead_error_periodic
from hil_sim.plant import amplifier

DT_S = 50e-6
MOTOR_KG, TABLE_KG = 20.0, 50.0
SCREW = drive_compliance.Params(stiffness_n_m=40e6, damping_n_s_m=2e3)
VISCOUS = viscous_friction.Params(400.0)


def push(t: float) -> float:
    return 100.0 * math.sin(2.0 * math.pi * 8.0 * t) + 60.0 * math.sin(2.0 * math.pi * 90.0 * t)


def test_two_masses_with_viscous_friction_agree_with_scipy(bench: Any) -> None:
    def motion(t: float, y: Any) -> list[float]:
        spring = SCREW.stiffness_n_m * (y[0] - y[2]) + SCREW.damping_n_s_m * (y[1] - y[3])
        return [y[1], (push(t) - spring) / MOTOR_KG, y[3], (spring - VISCOUS.viscous_n_s_m * y[3]) / TABLE_KG]

    axis = bench(MOTOR_KG, TABLE_KG, drive_compliance=SCREW, viscous_friction=VISCOUS)
    ours = axis.record(push, 0.3, "motor_position_m", "table_position_m", "transmitted_n")
    times = (np.arange(6000) + 1) * DT_S
    truth = solve_ivp(motion, (0.0, 0.3), [0.0] * 4, t_eval=times, rtol=1e-9, atol=1e-14, max_step=1e-3)
    size = np.abs(truth.y[2]).max()
    assert np.abs(ours["motor_position_m"] - truth.y[0]).max() < 4e-3 * size
    assert np.abs(ours["table_position_m"] - truth.y[2]).max() < 4e-3 * size


def test_free_oscillation_has_the_frequency_of_the_two_masses(bench: Any) -> None:
    axis = bench(MOTOR_KG, TABLE_KG, drive_compliance=drive_compliance.Params(40e6, 0.0))
    twist = axis.record(lambda t: 200.0 if t < 1e-3 else 0.0, 0.2, "transmitted_n")["transmitted_n"][100:]
    crossings = np.nonzero((twist[:-1] < 0.0) & (twist[1:] >= 0.0))[0]
    period_s = (crossings[-1] - crossings[0]) / (len(crossings) - 1) * DT_S
    omega = math.sqrt(40e6 * (1.0 / MOTOR_KG + 1.0 / TABLE_KG))
    assert 2.0 * math.pi / period_s == pytest.approx(omega, rel=2e-3)


def test_undamped_spring_neither_makes_nor_loses_energy(bench: Any) -> None:
    axis = bench(MOTOR_KG, TABLE_KG, drive_compliance=drive_compliance.Params(40e6, 0.0))
    force = axis.record(lambda t: 200.0 if t < 1e-3 else 0.0, 5.0, "transmitted_n")["transmitted_n"]
    early, late = np.abs(force[100:2000]).max(), np.abs(force[-2000:]).max()
    assert late == pytest.approx(early, rel=1e-3)


def energies(axis: Any, force_n: Any, seconds: float) -> dict[str, float]:
    names = ("motor_velocity_m_s", "table_velocity_m_s", "motor_position_m", "table_position_m", "friction_n")
    run = axis.record(force_n, seconds, *names)
    forces = np.array([force_n(k * DT_S) for k in range(len(run["friction_n"]))])

    def mean_velocity(name: str) -> Any:
        return (run[name] + np.concatenate([[0.0], run[name][:-1]])) / 2.0

    gap = run["motor_position_m"] - run["table_position_m"]
    return {
        "in": float(np.sum(forces * mean_velocity("motor_velocity_m_s")) * DT_S),
        "friction": float(np.sum(run["friction_n"] * mean_velocity("table_velocity_m_s")) * DT_S),
        "screw": float(np.sum(SCREW.damping_n_s_m * np.diff(gap) ** 2 / DT_S)),
        "stored": MOTOR_KG / 2.0 * run["motor_velocity_m_s"][-1] ** 2
        + TABLE_KG / 2.0 * run["table_velocity_m_s"][-1] ** 2
        + SCREW.stiffness_n_m / 2.0 * gap[-1] ** 2,
    }


@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"presliding_lugre": presliding_lugre.Params(1e7, 2e3)},
        {"presliding_gms": presliding_gms.Params((0.5, 0.5) + (0.0,) * 6, (5e6, 1e6) + (0.0,) * 6, 1e5, 2e3)},
    ],
    ids=["coulomb", "lugre", "gms"],
)
def test_work_put_in_is_stored_or_dissipated(bench: Any, effects: dict[str, Any]) -> None:
    axis = bench(
        MOTOR_KG,
        TABLE_KG,
        drive_compliance=SCREW,
        viscous_friction=VISCOUS,
        coulomb_friction=coulomb_friction.Params(30.0),
        **effects,
    )
    e = energies(axis, lambda t: 120.0 * math.sin(2.0 * math.pi * 6.0 * t), 0.55)
    assert e["friction"] > 0.5 * e["in"]
    assert e["stored"] > 0.02 * e["in"]
    assert e["friction"] + e["screw"] + e["stored"] == pytest.approx(e["in"], rel=4e-3)


def test_backlash_makes_no_energy(bench: Any) -> None:
    """Two masses that rattle freely in an undamped play keep their energy, and with damping only lose it."""
    for damping, kept in ((0.0, (0.9, 1.02)), (3e3, (0.0, 0.98))):
        axis = bench(
            MOTOR_KG,
            TABLE_KG,
            drive_compliance=drive_compliance.Params(40e6, damping),
            backlash=backlash.Params(5e-6),
        )
        run = axis.record(
            lambda t: 200.0 if t < 2e-3 else 0.0,
            1.0,
            "motor_velocity_m_s",
            "table_velocity_m_s",
            "transmitted_n",
        )
        free = run["transmitted_n"] == 0.0  # between impacts all the energy is kinetic
        energy = (
            MOTOR_KG / 2.0 * run["motor_velocity_m_s"] ** 2 + TABLE_KG / 2.0 * run["table_velocity_m_s"] ** 2
        )
        after = np.nonzero(free)[0]
        after = after[after > 60]
        drift = energy[after[-50:]].mean() / energy[after[0]]
        assert kept[0] <= drift <= kept[1]
        assert (run["transmitted_n"] != 0.0).sum() > 100


def test_slow_motion_through_backlash_follows_the_play_operator_of_equation_9(bench: Any) -> None:
    play_m = 10e-6
    axis = bench(
        MOTOR_KG,
        TABLE_KG,
        drive_compliance=drive_compliance.Params(300e6, 20e3),
        backlash=backlash.Params(play_m),
        coulomb_friction=coulomb_friction.Params(20.0),
        viscous_friction=viscous_friction.Params(2e3),
    )
    axis.plant.setpoint["loop"] = amplifier.POSITION
    x_in, x_out, table, played = [], [], [], 0.0
    for k in range(3000):
        axis.plant.setpoint["position_m"] = 200e-6 * math.sin(2.0 * math.pi * 0.5 * k * 1e-3)
        axis.advance(20)
        x_in.append(float(axis.state["motor_position_m"]))
        table.append(float(axis.state["table_position_m"]))
        # the play operator: equation (9) without its dependence on velocity
        played = min(max(played, x_in[-1] - play_m), x_in[-1] + play_m)
        x_out.append(played)
    assert np.ptp(table) > 30.0 * play_m
    assert np.abs(np.array(table) - np.array(x_out)).max() < 0.06 * play_m
    held = np.abs(np.diff(table)) == 0.0
    assert held.sum() > 50


def test_body_pushed_below_the_coulomb_level_does_not_move_at_all(bench: Any) -> None:
    axis = bench(coulomb_friction=coulomb_friction.Params(30.0))
    run = axis.record(lambda t: 29.9 * math.sin(300.0 * t), 0.2, "motor_position_m", "friction_n")
    assert not run["motor_position_m"].any()
    assert run["friction_n"][99] == pytest.approx(29.9 * math.sin(300.0 * 99 * DT_S))


def test_coasting_body_stops_once_without_chatter(bench: Any) -> None:
    axis = bench(coulomb_friction=coulomb_friction.Params(30.0))
    velocity = axis.record(lambda t: 100.0 if t < 0.1 else 0.0, 0.5, "motor_velocity_m_s")[
        "motor_velocity_m_s"
    ]
    assert velocity.min() == 0.0
    peak_m_s = (100.0 - 30.0) * 0.1 / 70.0
    stop_s = np.nonzero(velocity > 0.0)[0][-1] * DT_S
    assert velocity.max() == pytest.approx(peak_m_s, rel=2e-3)
    assert stop_s == pytest.approx(0.1 + peak_m_s * 70.0 / 30.0, abs=3.0 * DT_S)


@pytest.mark.parametrize("law", ["presliding_lugre", "presliding_gms"])
@pytest.mark.parametrize("kilograms", [2.0, 50.0, 500.0])
def test_stiff_presliding_of_1e8_n_per_m_is_stable_and_holds(bench: Any, kilograms: float, law: str) -> None:
    damping = 0.7 * 2.0 * math.sqrt(1e8 * kilograms)
    laws: dict[str, Any] = {
        "presliding_lugre": presliding_lugre.Params(1e8, damping),
        "presliding_gms": presliding_gms.Params(
            (0.5, 0.5) + (0.0,) * 6, (6e7, 4e7) + (0.0,) * 6, 1e3, damping
        ),
    }
    axis = bench(0.0, kilograms, coulomb_friction=coulomb_friction.Params(30.0), **{law: laws[law]})
    position = axis.record(lambda _: 10.0, 1.5, "motor_position_m")["motor_position_m"]
    # the contact carries the load: F / k = 0.1 um, more where a bristle creeps while it bends
    assert 9.99 / 1e8 < position[-1] < 0.2e-6
    assert np.ptp(position[-2000:]) < 2e-9


def test_gravity_holds_the_axis_against_friction_at_half_the_weight(bench: Any) -> None:
    axis = bench(constant_force=constant_force.Params(-50.0), coulomb_friction=coulomb_friction.Params(30.0))
    axis.record(lambda _: 25.0, 0.1, "motor_position_m")
    assert axis.state["motor_position_m"] == 0.0
    axis.record(lambda _: 0.0, 0.1, "motor_position_m")
    assert axis.state["motor_velocity_m_s"] == pytest.approx(-20.0 / 70.0 * 0.1, rel=1e-3)


@pytest.mark.parametrize("elastic", [False, True], ids=["rigid", "elastic"])
def test_table_follows_the_wobbling_screw(bench: Any, elastic: bool) -> None:
    effects: dict[str, Any] = {"lead_error_periodic": lead_error_periodic.Params(3e-6, 1.0, 0.0)}
    if elastic:
        effects["drive_compliance"] = SCREW
    axis = bench(MOTOR_KG, TABLE_KG, viscous_friction=VISCOUS, **effects)
    run = axis.record(lambda _: 20.0, 0.4, "motor_position_m", "table_position_m", "transmitted_n")
    wobble = 3e-6 * np.sin(2.0 * math.pi * run["motor_position_m"] / 0.01)
    assert np.ptp(run["motor_position_m"]) > 0.01
    windup = run["transmitted_n"] / SCREW.stiffness_n_m if elastic else 0.0
    assert np.abs(run["table_position_m"] - run["motor_position_m"] - wobble + windup).max() < 0.1e-6
