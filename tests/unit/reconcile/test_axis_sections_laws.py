"""Identified effects act in the plant by its own equations, with the same size and timing."""

import math
from pathlib import Path

import numpy as np
import pytest
from synthetic_findings import (
    BASE,
    FORCE,
    FORCE_CONSTANT_N_A,
    PERIOD_S,
    POSITION_DEVIATION,
    START_K,
    data,
    friction_w,
    updated_axis,
)
from temperature_step import temperature_after

from hil_sim.physics.friction import position_dependent_friction, temperature_dependent_friction
from hil_sim.physics.load import position_dependent_force
from hil_sim.physics.motor import amplifier_dead_zone, torque_constant_saturation, voltage_saturation
from hil_sim.physics.transmission import thermal_expansion
from reconcile.catalogue.kinds import RegressionData
from reconcile.catalogue.registry import ENTRIES

Rise = temperature_dependent_friction.State


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> RegressionData:
    return data(tmp_path_factory.mktemp("nominal"))


@pytest.fixture(scope="module")
def seen_warm(tmp_path_factory: pytest.TempPathFactory) -> RegressionData:
    return data(tmp_path_factory.mktemp("nominal"), warm=True)


def test_dead_zone_and_saturation_lose_the_force_that_was_missing(
    tmp_path: Path, seen: RegressionData
) -> None:
    strongest_n = 500.0
    found = {"loss_at_peak": 0.06, "peak_n": strongest_n}
    axis, _ = updated_axis(tmp_path, "torque_constant_saturation", FORCE, [found], seen)
    saturation = axis.effects["torque_constant_saturation"]
    for share in (1.0, 0.5):  # the entry's column is a cube
        asked_n = strongest_n * share * (1.0 + 0.06 * share**2)
        acting_a = torque_constant_saturation.force_producing_a(
            saturation, asked_n / FORCE_CONSTANT_N_A, 0.0, 0.0
        )
        assert acting_a * FORCE_CONSTANT_N_A == pytest.approx(strongest_n * share, rel=2e-3)
    axis, _ = updated_axis(tmp_path, "amplifier_dead_zone", FORCE, [{"threshold_n": 3.0}], seen)
    zone = axis.effects["amplifier_dead_zone"]
    passed_a = amplifier_dead_zone.force_producing_a(zone, -23.0 / FORCE_CONSTANT_N_A, 0.0, 0.0)
    assert passed_a * FORCE_CONSTANT_N_A == pytest.approx(-20.0)


def test_the_available_force_under_a_voltage_limit_is_that_of_the_catalogue(
    tmp_path: Path, seen: RegressionData
) -> None:
    found = {"stall_n": 900.0, "free_m_s": 0.2, "missing": 1.1}
    axis, _ = updated_axis(tmp_path, "voltage_saturation", FORCE, [found], seen)
    limit = axis.effects["voltage_saturation"]
    for velocity_m_s, available_n in ((0.0, 900.0), (0.1, 450.0), (-0.15, 225.0)):
        asked_a = math.copysign(800.0 if velocity_m_s else 1000.0, velocity_m_s) / FORCE_CONSTANT_N_A
        passed_a = voltage_saturation.force_producing_a(
            limit, asked_a, FORCE_CONSTANT_N_A * velocity_m_s, 0.0
        )
        assert abs(passed_a) * FORCE_CONSTANT_N_A == pytest.approx(available_n)


@pytest.mark.parametrize("effect", ["position_dependent_force", "position_dependent_friction"])
def test_cubics_over_the_travel_are_the_columns_of_the_catalogue(
    tmp_path: Path, seen: RegressionData, effect: str
) -> None:
    coefficients = np.array([2.0, -1.0, 0.7])
    [family] = ENTRIES[effect].terms
    shape = family.shapes([seen])[-1]
    needed_n = family.columns(seen, shape) @ coefficients
    found = {key: p.value for key, p in ENTRIES[effect].parameters(shape, coefficients).items()}
    axis, _ = updated_axis(tmp_path, effect, FORCE, [found], seen)
    p = axis.effects[effect]
    for i in range(0, len(needed_n), 97):
        x = float(seen.motion.position_m[i])
        if effect == "position_dependent_force":
            plant_n = -position_dependent_force.force_n(p, x, 0.0)
        else:
            plant_n = position_dependent_friction.level_n(p, x) * float(seen.motion.direction[i])
        assert plant_n == pytest.approx(needed_n[i], abs=1e-9)


def test_waves_of_one_pitch_are_added_and_those_the_plant_cannot_hold_are_noted(
    tmp_path: Path, seen: RegressionData
) -> None:
    """A sin + A cos is sqrt(2) A at 45 degrees."""
    twice = [{"harmonic": 1.0, "amplitude": 3e-6, "phase_rad": at} for at in (0.0, 0.5 * math.pi)]
    third = {"harmonic": 3.0, "amplitude": 1e-6, "phase_rad": 0.0}
    axis, [note] = updated_axis(tmp_path, "lead_error_periodic", POSITION_DEVIATION, [*twice, third], seen)
    wave = axis.effects["lead_error_periodic"]
    assert wave == pytest.approx((math.sqrt(2.0) * 3e-6, 1.0, 0.25 * math.pi))
    assert "harmonic 3 (amplitude 1e-06) is left out" in note


@pytest.mark.parametrize("change", [(-3.0, -40.0), (-11.0, 20.0), (9.0, 0.0)])
def test_friction_drifts_in_the_plant_as_it_did_over_the_run(
    tmp_path: Path, seen: RegressionData, change: tuple[float, float]
) -> None:
    """The plant's own balance of heat, under the mean of the recording's friction power.

    Its law bends, the more so the more is lost: over half of the change may be there in a third of the time.
    """
    level_n, viscous_n_s_m, time_s = *change, 5.0
    found = {"level_n": level_n, "viscous_n_s_m": viscous_n_s_m, "time_s": time_s}
    axis, notes = updated_axis(tmp_path, "temperature_dependent_friction", FORCE, [found], seen)
    assert not notes
    p = axis.effects["temperature_dependent_friction"]
    warmth_k, power_w, step_s = 0.0, friction_w(seen).mean(), 0.01
    for k in range(1, 6001):
        warmth_k = temperature_after(temperature_dependent_friction, p, warmth_k, power_w, step_s)
        level, damping = temperature_dependent_friction.factors(p, Rise(warmth_k), 0.0)
        share = 1.0 - math.exp(-k * step_s / time_s)
        lost = max(0.1, -level_n / BASE["coulomb_n"], -viscous_n_s_m / BASE["viscous_n_s_m"])
        bent = (1.0 - (1.0 - lost) ** share) / lost
        assert BASE["coulomb_n"] * (level - 1.0) == pytest.approx(level_n * bent, abs=0.01)
    assert BASE["coulomb_n"] * (level - 1.0) == pytest.approx(level_n, rel=1e-3)
    assert BASE["viscous_n_s_m"] * (damping - 1.0) == pytest.approx(viscous_n_s_m, rel=1e-3, abs=1e-6)


def test_friction_follows_the_recorded_temperature(tmp_path: Path, seen_warm: RegressionData) -> None:
    found = {"level_n": -0.2, "viscous_n_s_m": -2.0}
    axis, _ = updated_axis(tmp_path, "temperature_dependent_friction", FORCE, [found], seen_warm)
    p = axis.effects["temperature_dependent_friction"]
    assert seen_warm.temperature_k is not None
    warmth_k, off_n = 0.0, []
    for k, power_w in enumerate(friction_w(seen_warm)):
        level, _ = temperature_dependent_friction.factors(p, Rise(warmth_k), 0.0)
        off_n.append(BASE["coulomb_n"] * (level - 1.0) + 0.2 * (seen_warm.temperature_k[k] - START_K))
        warmth_k = temperature_after(temperature_dependent_friction, p, warmth_k, float(power_w), PERIOD_S)
    change_n = 0.2 * float(np.ptp(seen_warm.temperature_k))
    assert np.sqrt(np.mean(np.square(off_n))) < 0.1 * change_n


@pytest.mark.parametrize("growth", [6e-5, -6e-5])
def test_screw_grows_in_the_plant_as_it_did_over_the_run(
    tmp_path: Path, seen: RegressionData, growth: float
) -> None:
    found = {"growth": growth, "fixed_end_m": -0.2, "time_s": 30.0}
    axis, _ = updated_axis(tmp_path, "thermal_expansion", POSITION_DEVIATION, [found], seen)
    p = axis.effects["thermal_expansion"]
    kelvin, power_w, step_s = p.start_k, friction_w(seen).mean(), 0.01
    for k in range(1, 6001):
        kelvin = temperature_after(thermal_expansion, p, kelvin, power_w, step_s)
        screw = thermal_expansion.State(kelvin)
        wanted_m = growth * (1.0 - math.exp(-k * step_s / 30.0)) * (0.05 + 0.2)
        assert thermal_expansion.error_m(p, screw, 0.05, 0.0) == pytest.approx(wanted_m, rel=1e-2, abs=1e-9)
