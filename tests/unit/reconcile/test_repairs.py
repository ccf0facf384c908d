"""Every effect of the catalogue, once found, is in the plant that `hil-sim run` reads, with its numbers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest
from reconcile_findings import BASE, PERIOD_S, START_K, explanations, finding, model_file, scene

from hil_sim.config import build_plant, load_plant
from hil_sim.physics.friction import position_dependent_friction, temperature_dependent_friction
from hil_sim.physics.load import position_dependent_force
from hil_sim.physics.motor import amplifier_dead_zone, torque_constant_saturation, voltage_saturation
from hil_sim.physics.transmission import thermal_expansion
from reconcile.catalogue.kinds import Sense
from reconcile.catalogue.registry import ENTRIES
from reconcile.model_file import load_model, write_model
from reconcile.repairs import repair

if TYPE_CHECKING:
    from pathlib import Path

    from hil_sim.config import AxisPlant
    from reconcile.catalogue.kinds import Scene
    from reconcile.model_file import NominalAxis

FORCE, DEVIATION = Sense.FORCE, Sense.DEVIATION
LEAD_M = 5e-3
FORCE_CONSTANT_N_A = 0.4 * 2.0 * math.pi / LEAD_M
MOTOR_KG = 0.1e-4 * (2.0 * math.pi / LEAD_M) ** 2
PHASE = {"phase_rad": 0.7}
TRAVEL = {"centre_m": 0.01, "half_travel_m": 0.03}


class Case(NamedTuple):
    """What is found, and what the plant is to have; both in SI, written down by hand."""

    sense: Sense
    found: list[dict[str, float]]
    plant: dict[str, Any]


CASES: dict[str, Case] = {
    "amplifier_dead_zone": Case(
        FORCE, [{"threshold_n": 3.0, "width_n": 1.0}], {"threshold_a": 3.0 / FORCE_CONSTANT_N_A}
    ),
    "asymmetric_coulomb_friction": Case(FORCE, [{"half_difference_n": -2.0}], {"half_difference_n": -2.0}),
    "asymmetric_viscous_friction": Case(
        FORCE, [{"half_difference_n_s_m": 15.0}], {"half_difference_n_s_m": 15.0}
    ),
    "backlash": Case(DEVIATION, [{"play_m": 3e-6}], {"play_m": 3e-6}),
    "cogging": Case(
        FORCE,
        [
            {"harmonic": 4.0, "amplitude": 1.5, **PHASE},
            {"harmonic": 12.0, "amplitude": 2.5, "phase_rad": -2.0},
        ],
        {
            "harmonic": (12.0, 4.0, 0.0, 0.0, 0.0, 0.0),
            "amplitude_n": (2.5, 1.5, 0.0, 0.0, 0.0, 0.0),
            "phase_rad": (-2.0, 0.7, 0.0, 0.0, 0.0, 0.0),
        },
    ),
    "constant_force": Case(FORCE, [{"force_n": -6.0}], {"force_n": -6.0}),
    "cross_axis_coupling": Case(
        DEVIATION,
        [{"coefficient_1": 4e-5, "coefficient_2": 6e-5}],
        {"other": 1.0, "squareness": 4e-5, "bow_1_m": 0.0},
    ),
    "current_loop_lag": Case(FORCE, [{"time_s": 2.5e-3}], {"time_s": 2.5e-3}),
    "drive_compliance": Case(
        DEVIATION, [{"compliance_m_n": 1.25e-8, "stiffness_n_m": 8e7}], {"stiffness_n_m": 8e7}
    ),
    "dwell_dependent_breakaway": Case(
        FORCE,
        [{"growth_n": 4.0, "time_s": 1.5, "way_m": 1e-5}],
        {"growth_n": 4.0, "time_s": 1.5, "way_m": 1e-5},
    ),
    "encoder_eccentricity": Case(
        DEVIATION, [{"amplitude": 2e-6, **PHASE}], {"amplitude_m": 2e-6, "phase_rad": 0.7}
    ),
    "lead_error_cumulative": Case(DEVIATION, [{"relative_error": -3e-5}], {"relative_error": -3e-5}),
    "lead_error_periodic": Case(
        DEVIATION,
        [{"harmonic": 2.0, "amplitude": 4e-6, **PHASE}],
        {"harmonic": 2.0, "amplitude_m": 4e-6, "phase_rad": 0.7},
    ),
    "payload_mass": Case(FORCE, [{"mass_kg": 8.0}], {"mass_kg": 8.0}),
    "periodic_disturbance": Case(
        FORCE,
        [{"frequency_hz": 37.0, "amplitude": 2.0, **PHASE}],
        {"frequency_hz": 37.0, "amplitude_n": 2.0, "phase_rad": 0.7},
    ),
    "position_dependent_force": Case(FORCE, [{"power_1_n": 2.0, **TRAVEL}], {"power_1_n": 2.0, **TRAVEL}),
    "position_dependent_friction": Case(
        FORCE, [{"power_1_n": -1.0, **TRAVEL}], {"power_1_n": -1.0, **TRAVEL}
    ),
    "presliding_hysteresis": Case(FORCE, [{"level_n": 5.0, "way_m": 8e-6}], {"level_n": 5.0, "way_m": 8e-6}),
    "quadratic_viscous_friction": Case(FORCE, [{"quadratic_n_s2_m2": -40.0}], {"quadratic_n_s2_m2": -40.0}),
    "scale_cyclic_error": Case(
        DEVIATION,
        [{"period_m": 2e-5, "amplitude": 3e-7, **PHASE}],
        {"period_m": 2e-5, "amplitude_m": 3e-7, "phase_rad": 0.7},
    ),
    "stribeck_friction": Case(
        FORCE, [{"stribeck_n": -6.0, "stribeck_m_s": 3e-3}], {"stribeck_n": -6.0, "stribeck_m_s": 3e-3}
    ),
    "temperature_dependent_friction": Case(
        FORCE, [{"level_n": -3.0, "viscous_n_s_m": -40.0, "time_s": 5.0}], {}
    ),
    "thermal_expansion": Case(DEVIATION, [{"growth": 6e-5, "fixed_end_m": -0.2, "time_s": 30.0}], {}),
    "torque_constant_saturation": Case(FORCE, [{"loss_at_peak": 0.06, "peak_n": 500.0}], {}),
    "torque_ripple": Case(
        FORCE,
        [{"harmonic": 6.0, "amplitude": 0.04, **PHASE}],
        {
            "harmonic": (6.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            "amplitude": (0.04, 0.0, 0.0, 0.0, 0.0, 0.0),
            "phase_rad": (0.7, 0.0, 0.0, 0.0, 0.0, 0.0),
        },
    ),
    "transport_delay": Case(FORCE, [{"time_s": 1.7e-3}], {"delay_s": 1.7e-3}),
    "voltage_saturation": Case(FORCE, [{"stall_n": 900.0, "free_m_s": 0.2, "missing": 1.1}], {}),
}
"""Numbers of those without a plant's side here are held against the plant's law below."""


@pytest.fixture(scope="module")
def axis(tmp_path_factory: pytest.TempPathFactory) -> NominalAxis:
    return load_model(model_file(tmp_path_factory.mktemp("nominal"))).axes["x"]


@pytest.fixture(scope="module")
def seen(axis: NominalAxis) -> Scene:
    return scene(axis)


@pytest.fixture(scope="module")
def seen_warm(axis: NominalAxis) -> Scene:
    return scene(axis, warm=True)


def written(
    folder: Path,
    effect: str,
    sense: Sense,
    terms: list[dict[str, float]],
    seen: Scene,
    **nominal: Any,
) -> tuple[AxisPlant, list[str]]:
    """The axis with one finding, as `hil-sim run` reads it."""
    model = load_model(model_file(folder, **nominal))
    made = repair(explanations(sense, [finding(effect, sense, terms)], seen), model, "x")
    file = folder / "model.toml"
    write_model(model, {"x": made.sections}, file)
    config = load_plant(file)
    build_plant(config)
    return config.axes["x"], made.notes


def friction_w(seen: Scene) -> Any:
    """Power (n,) that heats the axis."""
    speed = np.abs(seen.motion.velocity_m_s)
    return speed * (BASE["coulomb_n"] + BASE["viscous_n_s_m"] * speed)


def test_every_entry_of_the_catalogue_has_a_case() -> None:
    assert set(ENTRIES) - {"unknown"} <= set(CASES)


@pytest.mark.parametrize("effect", CASES)
def test_what_was_found_is_what_the_plant_has(tmp_path: Path, seen: Scene, effect: str) -> None:
    case = CASES[effect]
    axis, notes = written(tmp_path, effect, case.sense, case.found, seen)
    has = axis.effects[effect]._asdict()
    for name, value in case.plant.items():
        assert has[name] == pytest.approx(value, rel=1e-9), name
    told = {"cross_axis_coupling", "thermal_expansion"}  # z is left out; a screw of steel is taken
    assert bool(notes) == (effect in told), notes
    if case.sense is FORCE and effect not in {"presliding_hysteresis", "payload_mass"}:
        assert axis.table.mass_kg == pytest.approx(BASE["mass_kg"] - MOTOR_KG)
        assert axis.effects["viscous_friction"].viscous_n_s_m == BASE["viscous_n_s_m"]
        assert axis.effects["coulomb_friction"].coulomb_n == BASE["coulomb_n"]


def test_parameters_of_the_catalogue_are_those_that_the_repairs_know(seen: Scene) -> None:
    """An entry whose parameters are called otherwise than in the cases would be written with holes."""
    for effect, entry in ENTRIES.items():
        if effect in CASES and entry.HYPOTHESES:
            [hypothesis, *_] = [h for h in entry.HYPOTHESES if h.sense is CASES[effect].sense]
            shape = next(iter(hypothesis.shapes([seen])), (37.0, 1.0))
            width = hypothesis.columns(seen, shape).shape[1]
            has = set(entry.parameters(shape, np.full(width, 0.5)))
            needed = {key for term in CASES[effect].found for key in term}
            assert needed <= has, effect


def test_dead_zone_and_saturation_lose_the_force_that_was_missing(tmp_path: Path, seen: Scene) -> None:
    strongest_n = 500.0
    found = {"loss_at_peak": 0.06, "peak_n": strongest_n}
    axis, _ = written(tmp_path, "torque_constant_saturation", FORCE, [found], seen)
    saturation = axis.effects["torque_constant_saturation"]
    for share in (1.0, 0.5):  # the entry's column is a cube
        asked_n = strongest_n * share * (1.0 + 0.06 * share**2)
        acting_a = torque_constant_saturation.passed_a(
            saturation, None, asked_n / FORCE_CONSTANT_N_A, 0.0, 0.0
        )
        assert acting_a * FORCE_CONSTANT_N_A == pytest.approx(strongest_n * share, rel=2e-3)
    axis, _ = written(tmp_path, "amplifier_dead_zone", FORCE, [{"threshold_n": 3.0}], seen)
    zone = axis.effects["amplifier_dead_zone"]
    passed_a = amplifier_dead_zone.passed_a(zone, None, -23.0 / FORCE_CONSTANT_N_A, 0.0, 0.0)
    assert passed_a * FORCE_CONSTANT_N_A == pytest.approx(-20.0)


def test_voltage_leaves_the_force_that_the_catalogue_says_is_available(tmp_path: Path, seen: Scene) -> None:
    found = {"stall_n": 900.0, "free_m_s": 0.2, "missing": 1.1}
    axis, _ = written(tmp_path, "voltage_saturation", FORCE, [found], seen)
    limit = axis.effects["voltage_saturation"]
    for velocity_m_s, available_n in ((0.0, 900.0), (0.1, 450.0), (-0.15, 225.0)):
        asked_a = math.copysign(800.0 if velocity_m_s else 1000.0, velocity_m_s) / FORCE_CONSTANT_N_A
        passed_a = voltage_saturation.passed_a(limit, None, asked_a, FORCE_CONSTANT_N_A * velocity_m_s, 0.0)
        assert abs(passed_a) * FORCE_CONSTANT_N_A == pytest.approx(available_n)


@pytest.mark.parametrize("effect", ["position_dependent_force", "position_dependent_friction"])
def test_cubics_over_the_travel_are_the_columns_of_the_catalogue(
    tmp_path: Path, seen: Scene, effect: str
) -> None:
    coefficients = np.array([2.0, -1.0, 0.7])
    [hypothesis] = ENTRIES[effect].HYPOTHESES
    shape = hypothesis.shapes([seen])[-1]
    needed_n = hypothesis.columns(seen, shape) @ coefficients
    found = {key: p.value for key, p in ENTRIES[effect].parameters(shape, coefficients).items()}
    axis, _ = written(tmp_path, effect, FORCE, [found], seen)
    p = axis.effects[effect]
    for i in range(0, len(needed_n), 97):
        x = float(seen.motion.position_m[i])
        if effect == "position_dependent_force":
            plant_n = -position_dependent_force.force_n(p, x, 0.0)
        else:
            plant_n = position_dependent_friction.level_n(p, x) * float(seen.motion.direction[i])
        assert plant_n == pytest.approx(needed_n[i], abs=1e-9)


def test_waves_of_one_pitch_are_added_and_those_beyond_the_plant_are_told(
    tmp_path: Path, seen: Scene
) -> None:
    """A sin + A cos is sqrt(2) A at 45 degrees."""
    twice = [{"harmonic": 1.0, "amplitude": 3e-6, "phase_rad": at} for at in (0.0, 0.5 * math.pi)]
    third = {"harmonic": 3.0, "amplitude": 1e-6, "phase_rad": 0.0}
    axis, [note] = written(tmp_path, "lead_error_periodic", DEVIATION, [*twice, third], seen)
    wave = axis.effects["lead_error_periodic"]
    assert wave == pytest.approx((math.sqrt(2.0) * 3e-6, 1.0, 0.25 * math.pi))
    assert "harmonic 3 (amplitude 1e-06) is left out" in note


@pytest.mark.parametrize("change", [(-3.0, -40.0), (-11.0, 20.0), (9.0, 0.0)])
def test_friction_drifts_in_the_plant_as_it_did_over_the_run(
    tmp_path: Path, seen: Scene, change: tuple[float, float]
) -> None:
    """The plant's own balance of heat, under the mean of the recording's friction power.

    Its law bends, the more so the more is lost: over half of the change may be there in a third of the time.
    """
    level_n, viscous_n_s_m, time_s = *change, 5.0
    found = {"level_n": level_n, "viscous_n_s_m": viscous_n_s_m, "time_s": time_s}
    axis, notes = written(tmp_path, "temperature_dependent_friction", FORCE, [found], seen)
    assert not notes
    p = axis.effects["temperature_dependent_friction"]
    warmth_k, power_w, step_s = 0.0, friction_w(seen).mean(), 0.01
    for k in range(1, 6001):
        warmth_k = temperature_dependent_friction.warmth_after_k(p, warmth_k, power_w, step_s)
        level, damping = temperature_dependent_friction.factors(p, 0.0, 0.0, warmth_k)
        share = 1.0 - math.exp(-k * step_s / time_s)
        lost = max(0.1, -level_n / BASE["coulomb_n"], -viscous_n_s_m / BASE["viscous_n_s_m"])
        bent = (1.0 - (1.0 - lost) ** share) / lost
        assert BASE["coulomb_n"] * (level - 1.0) == pytest.approx(level_n * bent, abs=0.01)
    assert BASE["coulomb_n"] * (level - 1.0) == pytest.approx(level_n, rel=1e-3)
    assert BASE["viscous_n_s_m"] * (damping - 1.0) == pytest.approx(viscous_n_s_m, rel=1e-3, abs=1e-6)


def test_friction_follows_the_recorded_temperature(tmp_path: Path, seen_warm: Scene) -> None:
    found = {"level_n": -0.2, "viscous_n_s_m": -2.0}
    axis, _ = written(tmp_path, "temperature_dependent_friction", FORCE, [found], seen_warm)
    p = axis.effects["temperature_dependent_friction"]
    assert seen_warm.temperature_k is not None
    warmth_k, off_n = 0.0, []
    for k, power_w in enumerate(friction_w(seen_warm)):
        level, _ = temperature_dependent_friction.factors(p, 0.0, 0.0, warmth_k)
        off_n.append(BASE["coulomb_n"] * (level - 1.0) + 0.2 * (seen_warm.temperature_k[k] - START_K))
        warmth_k = temperature_dependent_friction.warmth_after_k(p, warmth_k, float(power_w), PERIOD_S)
    change_n = 0.2 * float(np.ptp(seen_warm.temperature_k))
    assert np.sqrt(np.mean(np.square(off_n))) < 0.1 * change_n


@pytest.mark.parametrize("growth", [6e-5, -6e-5])
def test_screw_grows_in_the_plant_as_it_did_over_the_run(tmp_path: Path, seen: Scene, growth: float) -> None:
    found = {"growth": growth, "fixed_end_m": -0.2, "time_s": 30.0}
    axis, _ = written(tmp_path, "thermal_expansion", DEVIATION, [found], seen)
    p = axis.effects["thermal_expansion"]
    kelvin, power_w, step_s = p.start_k, friction_w(seen).mean(), 0.01
    for k in range(1, 6001):
        kelvin = thermal_expansion.temperature_after_k(p, kelvin, power_w, step_s)
        wanted_m = growth * (1.0 - math.exp(-k * step_s / 30.0)) * (0.05 + 0.2)
        assert thermal_expansion.error_m(p, 0.05, 0.0, kelvin) == pytest.approx(wanted_m, rel=1e-2, abs=1e-9)


def test_presliding_takes_its_share_of_the_friction_and_no_more(tmp_path: Path, seen: Scene) -> None:
    axis, notes = written(tmp_path, "presliding_hysteresis", FORCE, [{"level_n": 5.0, "way_m": 8e-6}], seen)
    assert axis.effects["coulomb_friction"].coulomb_n == pytest.approx(BASE["coulomb_n"] - 5.0)
    assert not notes
    axis, [note] = written(tmp_path, "presliding_hysteresis", FORCE, [{"level_n": 13.0, "way_m": 8e-6}], seen)
    assert axis.effects["coulomb_friction"].coulomb_n == 0.0
    assert axis.effects["presliding_hysteresis"].level_n == BASE["coulomb_n"]
    assert "found to be 13; it is held to the Coulomb friction, 12 N" in note


def test_ways_of_presliding_are_brought_together(tmp_path: Path, seen: Scene) -> None:
    """Two of one way are that way; one of hardly any friction does not count."""
    ways = [
        {"level_n": 3.0, "way_m": 8e-6},
        {"level_n": 4.0, "way_m": 8e-6},
        {"level_n": 1e-3, "way_m": 1e-4},
    ]
    axis, [note] = written(tmp_path, "presliding_hysteresis", FORCE, ways, seen)
    assert axis.effects["presliding_hysteresis"] == pytest.approx((7.001, 8e-6), rel=1e-2)
    assert "3 ways were found" in note


@pytest.mark.parametrize(
    ("effect", "sense", "found", "reason"),
    [
        ("presliding_hysteresis", FORCE, {"level_n": -2.0, "way_m": 8e-6}, "level_n was found to be -2"),
        ("backlash", DEVIATION, {"play_m": -1e-6}, "play_m was found to be -1e-06"),
        ("drive_compliance", DEVIATION, {"stiffness_n_m": -1e8}, "stiffness_n_m was found to be -1e+08"),
        (
            "torque_constant_saturation",
            FORCE,
            {"loss_at_peak": -0.1, "peak_n": 9.0},
            "more force comes of a high current",
        ),
        ("cross_axis_coupling", FORCE, {"coefficient_1": 2.0}, "no force goes from axis to axis"),
        ("unknown", FORCE, {"size_n": 2.0}, "it is in no catalogue"),
    ],
)
def test_what_no_plant_can_have_is_told_and_left_out(
    tmp_path: Path, seen: Scene, effect: str, sense: Sense, found: dict[str, float], reason: str
) -> None:
    axis, [note] = written(tmp_path, effect, sense, [found], seen)
    assert effect not in axis.effects
    assert note.startswith(f"model.toml, axis x: {effect} is not in the model: ")
    assert reason in note


def test_values_beyond_the_bounds_are_held_and_told(tmp_path: Path, seen: Scene) -> None:
    axis, [note] = written(tmp_path, "lead_error_cumulative", DEVIATION, [{"relative_error": 0.02}], seen)
    assert axis.effects["lead_error_cumulative"].relative_error == 0.01
    assert "lead_error_cumulative.relative_error was found to be 0.02; 0.01 is what it can be" in note
    dip = {"stribeck_n": -15.0, "stribeck_m_s": 3e-3}
    axis, [note] = written(tmp_path, "stribeck_friction", FORCE, [dip], seen)
    assert axis.effects["stribeck_friction"].stribeck_n == -BASE["coulomb_n"]
    assert "friction at rest cannot be below 0" in note
    stiff = [{"stiffness_n_m": 9e8}]
    axis, [note] = written(tmp_path, "drive_compliance", DEVIATION, stiff, seen, inertia_kg_cm2=0.01)
    assert axis.effects["drive_compliance"].stiffness_n_m < 9e8
    assert "too stiff for the substep of 50 us" in note


def test_voltage_limit_of_a_motor_with_a_winding_is_its_amplifiers(tmp_path: Path, seen: Scene) -> None:
    winding = "[axis.x.winding]\nresistance_ohm = 2.0\ninductance_mh = 5.0\n"
    found = {"stall_n": 900.0, "free_m_s": 60.0 / FORCE_CONSTANT_N_A, "missing": 1.0}
    axis, _ = written(tmp_path, "voltage_saturation", FORCE, [found], seen, extra=winding)
    assert "voltage_saturation" not in axis.effects
    assert axis.amplifier.voltage_limit_v == pytest.approx(60.0)


def test_payload_is_a_part_of_the_fitted_mass(tmp_path: Path, seen: Scene) -> None:
    axis, _ = written(tmp_path, "payload_mass", FORCE, [{"mass_kg": 8.0}], seen)
    assert axis.table.mass_kg + 8.0 + axis.motor_mass_kg == pytest.approx(BASE["mass_kg"])
