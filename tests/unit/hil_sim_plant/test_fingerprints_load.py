"""The image of loads and neighbouring axes in force and scale, and how they are distinguished."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hil_sim.config import build_plant, load_plant
from hil_sim.config.load import EFFECT_PARAMS
from hil_sim.physics.friction import coulomb_friction
from hil_sim.physics.load import constant_force, payload_mass, periodic_disturbance
from hil_sim.physics.motor import cogging, torque_ripple
from hil_sim.physics.sensor import cross_axis_coupling
from hil_sim.plant import amplifier
from hil_sim.plant.integrate import advance

XY_TABLE = Path(__file__).parents[3] / "machines" / "xy_table"
FEWER_AMPERES = torque_ripple.Params((0.0,) * 6, (0.1,) + (0.0,) * 5, (-0.5 * math.pi,) + (0.0,) * 5)
"""No ripple at all: a torque constant that is 10 % lower everywhere."""
CATALOGUE = {
    "asymmetric_coulomb_friction",
    "asymmetric_viscous_friction",
    "stribeck_friction",
    "quadratic_viscous_friction",
    "presliding_hysteresis",
    "dwell_dependent_breakaway",
    "position_dependent_friction",
    "temperature_dependent_friction",
    "backlash",
    "drive_compliance",
    "lead_error_cumulative",
    "lead_error_periodic",
    "thermal_expansion",
    "cogging",
    "torque_ripple",
    "torque_constant_saturation",
    "current_loop_lag",
    "amplifier_dead_zone",
    "transport_delay",
    "scale_cyclic_error",
    "encoder_eccentricity",
    "constant_force",
    "position_dependent_force",
    "periodic_disturbance",
    "payload_mass",
    "cross_axis_coupling",
    "voltage_saturation",
}


def test_every_effect_of_the_catalogue_is_in_the_plant_and_its_fingerprint_is_tested() -> None:
    assert set(EFFECT_PARAMS) >= CATALOGUE
    tests = "".join(file.read_text() for file in Path(__file__).parent.glob("test_fingerprints_*.py"))
    named = " ".join(re.findall(r"def test_(\w+)", tests))
    assert [name for name in CATALOGUE if name not in named] == []


def test_constant_force_is_even_in_the_direction(bench: Any) -> None:
    rubbing = coulomb_friction.Params(20.0)
    axis = bench(coulomb_friction=rubbing, constant_force=constant_force.Params(-50.0))
    _, needed_n = axis.at_speeds([0.05, 0.1, -0.05, -0.1])
    assert needed_n == pytest.approx(np.array([70.0, 70.0, 30.0, 30.0]), abs=1e-6)


def strongest_hz(run: Any) -> float:
    """Frequency of the largest line of the residual."""
    spectrum = np.abs(np.fft.rfft((run.residual_n - run.residual_n.mean()) * np.hanning(len(run.residual_n))))
    return float(np.argmax(spectrum) / run.time_s[-1])


def test_periodic_disturbance_keeps_its_frequency_at_any_speed_and_cogging_does_not(bench: Any) -> None:
    once_a_turn = cogging.Params((1.0,) * 6, (4.0,) + (0.0,) * 5, (0.0,) * 6)
    for speed, turns_hz in ((0.1, 10.0), (0.3, 30.0)):
        hertz = []
        for effect in (
            {"periodic_disturbance": periodic_disturbance.Params(4.0, 17.0, 0.2)},
            {"cogging": once_a_turn},
        ):
            axis = bench(**effect)
            axis.observe(0.1, velocity=lambda _, v=speed: v)
            hertz.append(strongest_hz(axis.observe(0.5, velocity=lambda _, v=speed: v)))
        assert hertz == pytest.approx([17.0, turns_hz], abs=2.0)


def test_periodic_disturbance_pushes_with_its_amplitude_and_phase(bench: Any) -> None:
    axis = bench(periodic_disturbance=periodic_disturbance.Params(4.0, 17.0, 0.2))
    run = axis.observe(0.2, force=lambda _: 0.0)
    before_s = run.time_s - 50e-6
    expected = -4.0 * np.sin(2.0 * math.pi * 17.0 * before_s + 0.2)
    assert run.residual_n == pytest.approx(expected, abs=1e-6)


def test_payload_mass_is_in_proportion_to_the_acceleration_and_a_torque_constant_to_the_force(
    bench: Any,
) -> None:
    hung = {"constant_force": constant_force.Params(-100.0)}
    slopes = []
    for effect in ({"payload_mass": payload_mass.Params(7.0)}, {"torque_ripple": FEWER_AMPERES}):
        run = bench(**hung, **effect).observe(0.3, force=lambda t: 100.0 + 300.0 * math.sin(30.0 * t))
        acceleration = (run.force_n - run.residual_n) / 70.0
        slopes.append(np.polyfit(acceleration, run.residual_n - 100.0, 1))
    assert slopes[0] == pytest.approx(np.array([7.0, 0.0]), abs=1e-6)
    assert slopes[1] == pytest.approx(np.array([70.0 * 0.1 / 0.9, 100.0 * 0.1 / 0.9]), abs=1e-6)


def table(**coupling: float) -> tuple[Any, Any]:
    """An X-Y table whose y scale follows x."""
    config = load_plant(XY_TABLE)
    effects = config.axes["y"].effects | {"cross_axis_coupling": cross_axis_coupling.Params(0.0, **coupling)}
    y = config.axes["y"].model_copy(update={"effects": effects})
    return config, build_plant(config.model_copy(update={"axes": config.axes | {"y": y}}))


@pytest.mark.parametrize("calls", [50, 100])
def test_cross_axis_coupling_follows_the_other_axis_at_the_same_instant(calls: int) -> None:
    config, plant = table(squareness=200e-6, bow_1_m=1e-3)
    plant.setpoint["loop"] = amplifier.POSITION
    for k in range(calls):
        plant.setpoint["position_m"] = [0.01, 0.0] if 2 * k < calls else [0.02, 0.0]
        advance(*plant, 20_000 // calls, config.dt_s)
        x, y = plant.state
        error_m = 200e-6 * x["table_position_m"] + 1e-3 * x["table_position_m"] ** 2
        shown_m = y["scale_counts"] * 0.1e-6
        assert shown_m - y["table_position_m"] == pytest.approx(error_m, abs=0.051e-6)
    assert x["table_position_m"] > 0.015
    assert abs(y["table_position_m"]) < 1e-7


def test_cross_axis_coupling_moves_nothing_and_leaves_the_other_axis_alone() -> None:
    config, coupled = table(squareness=200e-6)
    plain = build_plant(config)
    for plant in (coupled, plain):
        plant.setpoint["loop"] = amplifier.VELOCITY
        plant.setpoint["velocity_m_s"] = [0.05, -0.02]
        advance(*plant, 4000, config.dt_s)
    for name in ("motor_position_m", "table_position_m", "encoder_counts", "current_a"):
        assert np.array_equal(coupled.state[name], plain.state[name])
    assert coupled.state["scale_counts"][0] == plain.state["scale_counts"][0]
    assert coupled.state["scale_counts"][1] != plain.state["scale_counts"][1]
