"""A spring identified from motor and scale is one spring; a rotor inertia that is too large is reduced."""

import math
from pathlib import Path
from typing import Any, cast

import pytest
from synthetic_findings import BASE, FORCE, POSITION_DEVIATION, data, explanations, finding, model_file

from reconcile.model_update.axis_sections import axis_sections
from reconcile.nominal_model.model_file import load_model

BY_MOTOR = {"stiffness_n_m": 5.2e6, "damping_n_s_m": 900.0, "load_mass_kg": 35.0, "antiresonance_hz": 61.0}
BY_SCALE = {"compliance_m_n": 1.0 / 4.6e6, "stiffness_n_m": 4.6e6}
TURN_RAD_M = 2.0 * math.pi / 5e-3


def test_the_spring_is_written_once_with_the_values_from_the_force(tmp_path: Path) -> None:
    seen, model = data(tmp_path), load_model(model_file(tmp_path))
    force, deviation = explanations(FORCE, [finding("drive_compliance", FORCE, [BY_MOTOR])], seen)
    scale = finding("drive_compliance", POSITION_DEVIATION, [BY_SCALE])
    both: Any = [force, deviation._replace(findings=[scale])]
    made = axis_sections(both, model, "x")
    assert made.left_out == {}
    assert made.sections["drive_compliance"]["stiffness_n_um"] == pytest.approx(5.2)
    assert made.sections["table"]["mass_kg"] == pytest.approx(35.0)


def test_a_load_heavier_than_all_that_moves_leaves_the_motor_a_fiftieth(tmp_path: Path) -> None:
    seen, model = data(tmp_path), load_model(model_file(tmp_path))
    heavy = {**BY_MOTOR, "load_mass_kg": 1.1 * BASE["mass_kg"]}
    found: Any = explanations(FORCE, [finding("drive_compliance", FORCE, [heavy])], seen)
    made = axis_sections(found, model, "x")
    motor_kg = made.sections["motor"]["inertia_kg_cm2"] * 1e-4 * TURN_RAD_M**2
    assert motor_kg == pytest.approx(0.02 * BASE["mass_kg"])
    assert made.sections["table"]["mass_kg"] == pytest.approx(0.98 * BASE["mass_kg"])
    assert any("something must move before the spring" in note for note in made.notes)


@pytest.mark.parametrize("moved_kg", [8.0, 40.0])
def test_less_mass_than_the_rotor_has_is_shared_as_the_model_has_it(tmp_path: Path, moved_kg: float) -> None:
    seen, model = data(tmp_path), load_model(model_file(tmp_path))
    rotor_kg = model.axes["x"].motor_mass_kg
    force, _ = explanations(FORCE, [finding("constant_force", FORCE, [{"force_n": 1.0}])], seen)
    made = axis_sections(cast(Any, [force._replace(base={**BASE, "mass_kg": moved_kg})]), model, "x")
    kept_kg = made.sections.get("motor", {}).get("inertia_kg_cm2", rotor_kg / TURN_RAD_M**2 * 1e4)
    kept_kg *= 1e-4 * TURN_RAD_M**2
    assert kept_kg + made.sections["table"]["mass_kg"] == pytest.approx(moved_kg)
    assert (kept_kg == pytest.approx(rotor_kg)) is (moved_kg > rotor_kg)
