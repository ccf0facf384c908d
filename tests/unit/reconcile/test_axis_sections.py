"""Every identified effect of the catalogue is in the plant that `hil-sim run` reads, with its values."""

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from synthetic_findings import BASE, FORCE, FORCE_CONSTANT_N_A, POSITION_DEVIATION, data, updated_axis

from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.catalogue.registry import ENTRIES

MOTOR_KG = 0.1e-4 * (2.0 * math.pi / 5e-3) ** 2
PHASE = {"phase_rad": 0.7}
TRAVEL = {"centre_m": 0.01, "half_travel_m": 0.03}


class Case(NamedTuple):
    """Finding, and the expected parameters of the plant; both in SI, written by hand."""

    channel: ResidualChannel
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
    "backlash": Case(POSITION_DEVIATION, [{"play_m": 3e-6}], {"play_m": 3e-6}),
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
        POSITION_DEVIATION,
        [{"coefficient_1": 4e-5, "coefficient_2": 6e-5}],
        {"other": 1.0, "squareness": 4e-5, "bow_1_m": 0.0},
    ),
    "current_loop_lag": Case(FORCE, [{"time_s": 2.5e-3}], {"time_s": 2.5e-3}),
    "drive_compliance": Case(
        POSITION_DEVIATION, [{"compliance_m_n": 1.25e-8, "stiffness_n_m": 8e7}], {"stiffness_n_m": 8e7}
    ),
    "dwell_dependent_breakaway": Case(
        FORCE,
        [{"growth_n": 4.0, "time_s": 1.5, "way_m": 1e-5}],
        {"growth_n": 4.0, "time_s": 1.5, "way_m": 1e-5},
    ),
    "encoder_eccentricity": Case(
        POSITION_DEVIATION, [{"amplitude": 2e-6, **PHASE}], {"amplitude_m": 2e-6, "phase_rad": 0.7}
    ),
    "gravity": Case(
        FORCE,
        [{"amplitude_n": 4.0, "angle_rad_m": 1.0, **PHASE}],
        {"amplitude_n": 4.0, "angle_rad_m": 1.0, "phase_rad": 0.7},
    ),
    "gravity_of_outer_link": Case(
        FORCE,
        [{"other": 0.0, "amplitude_n": 4.0, "sense": -1.0, **PHASE}],
        {"other": 1.0, "amplitude_n": 4.0, "sense": -1.0, "phase_rad": 0.7},
    ),
    "joint_coupling": Case(
        FORCE,
        [{"other": 0.0, "outer": 1.0, "inertia_kg": 3.0, "arm_kg": 2.0, **PHASE}],
        {"other": 1.0, "outer": 1.0, "inertia_kg": 3.0, "arm_kg": 2.0, "phase_rad": 0.7},
    ),
    "lead_error_cumulative": Case(POSITION_DEVIATION, [{"relative_error": -3e-5}], {"relative_error": -3e-5}),
    "lead_error_periodic": Case(
        POSITION_DEVIATION,
        [{"harmonic": 2.0, "amplitude": 4e-6, **PHASE}],
        {"harmonic": 2.0, "amplitude_m": 4e-6, "phase_rad": 0.7},
    ),
    "load_dependent_friction": Case(
        FORCE, [{"load_share": 0.12, "friction_share": 1.0}], {"load_share": 0.12, "friction_share": 1.0}
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
        POSITION_DEVIATION,
        [{"period_m": 2e-5, "amplitude": 3e-7, **PHASE}],
        {"period_m": 2e-5, "amplitude_m": 3e-7, "phase_rad": 0.7},
    ),
    "stribeck_friction": Case(
        FORCE, [{"stribeck_n": -6.0, "stribeck_m_s": 3e-3}], {"stribeck_n": -6.0, "stribeck_m_s": 3e-3}
    ),
    "temperature_dependent_friction": Case(
        FORCE, [{"level_n": -3.0, "viscous_n_s_m": -40.0, "time_s": 5.0}], {}
    ),
    "thermal_expansion": Case(
        POSITION_DEVIATION, [{"growth": 6e-5, "fixed_end_m": -0.2, "time_s": 30.0}], {}
    ),
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
"""Values of effects without expected parameters here are compared with the plant's equations below."""


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> RegressionData:
    return data(tmp_path_factory.mktemp("nominal"))


def test_every_entry_of_the_catalogue_has_a_case() -> None:
    assert set(ENTRIES) <= set(CASES)


@pytest.mark.parametrize("effect", CASES)
def test_identified_parameters_become_those_of_the_plant(
    tmp_path: Path, seen: RegressionData, effect: str
) -> None:
    case = CASES[effect]
    axis, notes = updated_axis(tmp_path, effect, case.channel, case.found, seen)
    has = axis.effects[effect]._asdict()
    for name, value in case.plant.items():
        assert has[name] == pytest.approx(value, rel=1e-9), name
    with_notes = {"cross_axis_coupling", "thermal_expansion"}  # z is left out; a screw of steel is taken
    assert bool(notes) == (effect in with_notes), notes
    if case.channel is FORCE and effect not in {"presliding_hysteresis", "payload_mass"}:
        assert axis.table.mass_kg == pytest.approx(BASE["mass_kg"] - MOTOR_KG)
        assert axis.effects["viscous_friction"].viscous_n_s_m == BASE["viscous_n_s_m"]
        assert axis.effects["coulomb_friction"].coulomb_n == BASE["coulomb_n"]


def test_parameters_of_the_catalogue_are_those_that_the_repairs_know(seen: RegressionData) -> None:
    """Parameters of entries have the names used in the cases; else values would be missing in the file."""
    for effect, entry in ENTRIES.items():
        [family] = [f for f in entry.terms if f.channel is CASES[effect].channel]
        shape = next(
            iter(family.shapes([seen])), (0.0, 1.0) if "other" in CASES[effect].plant else (37.0, 1.0)
        )
        width = family.columns(seen, shape).shape[1]
        has = set(entry.parameters(shape, np.full(width, 0.5)))
        needed = {key for term in CASES[effect].found for key in term}
        assert needed <= has, effect
