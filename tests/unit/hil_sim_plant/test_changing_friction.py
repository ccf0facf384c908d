"""Friction that changes while the axis runs: force at constant speed, energy, reversals."""

import math
from typing import Any

import numpy as np
import pytest

from hil_sim.physics.friction import (
    coulomb_friction,
    friction_ageing,
    lubrication_loss,
    presliding_gms,
    presliding_lugre,
    stribeck_friction,
    temperature_dependent_friction,
    viscous_friction,
)
from hil_sim.plant import amplifier

DT_S = 50e-6
SPEED_M_S = 0.05
LEVEL_N, DAMPING_N_S_M = 20.0, 100.0
SLIDING = {
    "coulomb_friction": coulomb_friction.Params(LEVEL_N),
    "viscous_friction": viscous_friction.Params(DAMPING_N_S_M),
}
LAWS: dict[str, dict[str, Any]] = {
    "stick or slide": {},
    "LuGre": {"presliding_lugre": presliding_lugre.Params(6e6, 1e3)},
    "GMS": {
        "presliding_gms": presliding_gms.Params(
            (0.5, 0.3, 0.2) + (0.0,) * 5, (4e6, 1e6, 3e5) + (0.0,) * 5, 5e4, 500.0
        )
    },
}
every_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())
DRY = lubrication_loss.Params(start_s=0.5, transition_s=0.2, level_factor=1.8, damping_factor=0.5)
# as fast as a test needs it: 20 K within the run, 5 % per metre
WARM = temperature_dependent_friction.Params(0.6, 0.3, 1.0, 1.0, 2.0)
WORN = friction_ageing.Params(0.9, -0.5)


def friction_at_constant_speed(bench: Any, seconds: float, **effects: Any) -> Any:
    """Friction force (N) every 50 ms from 0.3 s on, when the velocity loop has settled."""
    axis = bench(**SLIDING, **effects)
    axis.plant.setpoint["loop"] = amplifier.VELOCITY
    axis.plant.setpoint["velocity_m_s"] = SPEED_M_S
    axis.advance(6000)
    force = [float(axis.state["friction_n"])]
    for _ in range(round((seconds - 0.3) / 0.05)):
        axis.advance(1000)
        force.append(float(axis.state["friction_n"]))
        assert axis.state["table_velocity_m_s"] == pytest.approx(SPEED_M_S, rel=0.02)
    return np.array(force)


@every_law
def test_force_at_constant_speed_rises_by_the_factor_when_lubrication_is_lost(
    bench: Any, law: dict[str, Any]
) -> None:
    force = friction_at_constant_speed(bench, 1.5, lubrication_loss=DRY, **law)
    assert force[:4] == pytest.approx(LEVEL_N + DAMPING_N_S_M * SPEED_M_S, rel=1e-3)
    assert force[-10:] == pytest.approx(1.8 * LEVEL_N + 0.5 * DAMPING_N_S_M * SPEED_M_S, rel=1e-3)


@every_law
def test_force_at_constant_speed_grows_with_the_distance(bench: Any, law: dict[str, Any]) -> None:
    force = friction_at_constant_speed(bench, 3.0, friction_ageing=WORN, **law)
    travelled_m = SPEED_M_S * np.arange(0.3, 3.001, 0.05)
    expected = LEVEL_N * (1.0 + 0.9 * travelled_m) + DAMPING_N_S_M * SPEED_M_S * (1.0 - 0.5 * travelled_m)
    assert force == pytest.approx(expected, rel=2e-3)


@every_law
def test_force_at_constant_speed_falls_to_its_thermal_equilibrium(bench: Any, law: dict[str, Any]) -> None:
    """Settled: T = R P, P = F v, F = levels and damping at T."""
    force = friction_at_constant_speed(bench, 15.0, temperature_dependent_friction=WARM, **law)
    settled_n = LEVEL_N + DAMPING_N_S_M * SPEED_M_S
    for _ in range(100):
        cold = math.exp(-WARM.resistance_k_w * settled_n * SPEED_M_S / WARM.warmth_scale_k)
        settled_n = LEVEL_N * (0.6 + 0.4 * cold) + DAMPING_N_S_M * SPEED_M_S * (0.3 + 0.7 * cold)
    assert (np.diff(force) < 0.01).all()
    assert force[0] > settled_n + 2.0
    assert force[-1] == pytest.approx(settled_n, rel=2e-3)


def test_lubrication_is_lost_at_rest_too_but_wear_and_heating_need_motion(bench: Any) -> None:
    axis = bench(**SLIDING, lubrication_loss=DRY, friction_ageing=WORN, temperature_dependent_friction=WARM)
    axis.advance(20_000)
    assert axis.state["friction_ageing"]["travelled_m"] == 0.0
    assert axis.state["temperature_dependent_friction"]["temperature_rise_k"] == 0.0
    axis.force(1.79 * LEVEL_N)
    axis.advance(1000)
    assert axis.state["table_velocity_m_s"] == 0.0
    axis.force(1.81 * LEVEL_N)
    axis.advance(1000)
    assert axis.state["table_velocity_m_s"] > 0.0


def test_distance_counts_both_directions(bench: Any) -> None:
    axis = bench(**SLIDING, friction_ageing=WORN)
    run = axis.record(lambda t: 100.0 * math.cos(20.0 * t), 1.0, "table_position_m")["table_position_m"]
    assert axis.state["friction_ageing"]["travelled_m"] == pytest.approx(np.abs(np.diff(run)).sum(), rel=1e-3)
    assert axis.state["friction_ageing"]["travelled_m"] > 3.0 * np.ptp(run)


@every_law
def test_friction_that_changes_only_takes_energy(bench: Any, law: dict[str, Any]) -> None:
    """Beyond what the contact's springs store, the work of friction never falls, whatever its level does."""
    axis = bench(
        **SLIDING,
        **law,
        stribeck_friction=stribeck_friction.Params(6.0, 0.003),
        lubrication_loss=DRY._replace(level_factor=0.2),
        friction_ageing=WORN,
        temperature_dependent_friction=WARM,
    )
    run = axis.record(
        lambda t: 60.0 * math.sin(2.0 * math.pi * 4.0 * t), 1.2, "friction_n", "table_velocity_m_s"
    )
    velocity = run["table_velocity_m_s"]
    mean = (velocity + np.concatenate([[0.0], velocity[:-1]])) / 2.0
    work = np.cumsum(run["friction_n"] * mean) * DT_S
    stored_j = 2e-4  # sum of (alpha s)^2 / 2 k at the highest level
    assert work[-1] > 100.0 * stored_j
    assert (work >= np.maximum.accumulate(work) - stored_j).all()


@pytest.mark.parametrize(
    "change", [{"lubrication_loss": DRY}, {"friction_ageing": WORN}, {"temperature_dependent_friction": WARM}]
)
def test_a_long_call_equals_many_short_ones_while_friction_changes(
    bench: Any, change: dict[str, Any]
) -> None:
    long, short = (bench(**SLIDING, **LAWS["GMS"], **change) for _ in range(2))
    for axis in (long, short):
        axis.force(45.0)
    long.advance(16_000)
    for _ in range(1600):
        short.advance(10)
    assert long.state["table_velocity_m_s"] != 0.0
    assert long.state.tobytes() == short.state.tobytes()
