"""Sections that a model update has written are read back as the candidate terms of their findings."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from synthetic_findings import BASE, CENTRE_M, FORCE, POSITION_DEVIATION, data, updated_axis

from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelTerm
from reconcile.catalogue.kinds import RegressionData, ResidualChannel, ShapeParameters
from reconcile.catalogue.registry import ENTRIES
from reconcile.formats.nominal_axis import ModelEffects, NominalAxis, baseline_parameters
from reconcile.nominal_model.model_effects import model_effects_of
from reconcile.nominal_model.model_file import load_model
from reconcile.nominal_model.model_terms import terms_of_model

Term = tuple[ShapeParameters, tuple[float, ...]]

RUBBING = """
[axis.x.viscous_friction]
viscous_n_s_m = 100.0
[axis.x.coulomb_friction]
coulomb_n = 12.0
"""


class Case(NamedTuple):
    """Shapes and coefficients of the findings, and the relative tolerance of those read back."""

    channel: ResidualChannel
    terms: list[Term]
    within: float = 1e-9


CASES: dict[str, Case] = {
    "asymmetric_viscous_friction": Case(FORCE, [((), (15.0,))]),
    "backlash": Case(POSITION_DEVIATION, [((3e-6, 12.0 / 30.0, 100.0 / 30.0), (3e-6,))]),
    "cogging": Case(FORCE, [((12.0,), (-2.0, 1.5)), ((4.0,), (0.0, 1.5))]),
    "constant_force": Case(FORCE, [((), (-6.0,))]),
    "cross_axis_coupling": Case(POSITION_DEVIATION, [((), (4e-5, 0.0))]),
    "current_loop_lag": Case(FORCE, [((2.5e-3, 1.0), (1.0,))]),
    "drive_compliance": Case(POSITION_DEVIATION, [((), (1.25e-8,))]),
    "dwell_dependent_breakaway": Case(FORCE, [((1e-5, 1.5), (4.0,))]),
    "gravity": Case(FORCE, [((1.0,), (4.0, -3.0))]),
    "gravity_of_outer_link": Case(FORCE, [((0.0, 1.0), (4.0, -3.0))]),
    "joint_coupling": Case(FORCE, [((0.0, 1.0), (3.0, 2.0, -1.0))]),
    "lead_error_cumulative": Case(POSITION_DEVIATION, [((), (-3e-5,))]),
    "lead_error_periodic": Case(POSITION_DEVIATION, [((2.0,), (-4e-6, 1e-6))]),
    "load_dependent_friction": Case(FORCE, [((1.0,), (0.12,))]),
    "periodic_disturbance": Case(FORCE, [((37.0,), (1.5, -2.0))]),
    "position_dependent_force": Case(FORCE, [((2.0, CENTRE_M, 0.03), (2.0, -1.0))]),
    "position_dependent_friction": Case(FORCE, [((3.0, CENTRE_M, 0.03), (2.0, -1.0, 0.7))]),
    "presliding_hysteresis": Case(FORCE, [((8e-6, 0.0), (5.0,)), ((3e-5, 2.0), (3.0,))]),
    "quadratic_viscous_friction": Case(FORCE, [((), (-40.0,))]),
    "scale_cyclic_error": Case(POSITION_DEVIATION, [((2e-5,), (3e-7, -1e-7))]),
    "stribeck_friction": Case(FORCE, [((3e-3,), (-6.0,))]),
    "torque_ripple": Case(FORCE, [((6.0,), (0.04, -0.01)), ((2.0,), (0.0, 0.02))]),
    "transport_delay": Case(FORCE, [((1.7e-3,), (1.0,))]),
    "voltage_saturation": Case(FORCE, [((600.0, 0.2), (1.0,))]),
    "temperature_dependent_friction": Case(FORCE, [((5.0, 0.0), (-3.0, -40.0))]),
    "thermal_expansion": Case(POSITION_DEVIATION, [((30.0, 0.0), (6e-5, 1.2e-5, 0.0))]),
}
"""A candidate of each entry whose shape is also the plant's."""
SCANNED: dict[str, Case] = {
    "amplifier_dead_zone": Case(FORCE, [((), (3.0,))]),
    "torque_constant_saturation": Case(FORCE, [((), (0.06,))]),
}
"""Entries whose shape is from the recording, and no parameter of the plant."""
WARM: dict[str, Case] = {
    "temperature_dependent_friction": Case(FORCE, [((), (-0.2, -2.0))], within=1e-3),
    "thermal_expansion": Case(POSITION_DEVIATION, [((), (1.2e-5, 2.4e-6))]),
}
"""Where a temperature was recorded, the shape is its start; the heat balance is a fit to it."""


def _with_scanned_shape(effect: str, case: Case, seen: RegressionData) -> Case:
    [(_, coefficients)] = case.terms
    return case._replace(terms=[(ENTRIES[effect].terms[0].shapes([seen])[0], coefficients)])


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> RegressionData:
    return data(tmp_path_factory.mktemp("nominal"))


@pytest.fixture(scope="module")
def seen_warm(tmp_path_factory: pytest.TempPathFactory) -> RegressionData:
    return data(tmp_path_factory.mktemp("nominal"), warm=True)


def _read(file: Path) -> tuple[ModelEffects, NominalAxis]:
    model = load_model(file)
    return model_effects_of(file, "x", model.document["axis"]), model.axes["x"]


def _read_back(folder: Path, effect: str, case: Case, seen: RegressionData) -> list[ModelTerm]:
    """Write a model with these terms, read it; return its terms."""
    terms = [
        {name: p.value for name, p in ENTRIES[effect].parameters(shape, np.array(coefficients)).items()}
        for shape, coefficients in case.terms
    ]
    updated_axis(folder, effect, case.channel, terms, seen, extra=RUBBING)
    held, axis = _read(folder / "model.toml")
    return terms_of_model(axis._replace(model_effects=held), [seen])


def _predicted(effect: str, case: Case, terms: Sequence[Term], seen: RegressionData) -> Array:
    [family] = [f for f in ENTRIES[effect].terms if f.channel is case.channel]
    return sum(
        (family.columns(seen, shape) @ np.array(coefficients) for shape, coefficients in terms),
        np.zeros(len(seen.time_s)),
    )


def _holds(folder: Path, effect: str, case: Case, seen: RegressionData) -> None:
    model_terms = _read_back(folder, effect, case, seen)
    assert {(k.effect, k.channel) for k in model_terms} == {(effect, case.channel)}
    found = {k.shape_parameters: k.coefficients for k in model_terms}
    assert len(found) == len(model_terms) == len(case.terms)
    for (shape, coefficients), has in zip(case.terms, found, strict=True):
        assert has == pytest.approx(shape, rel=1e-9)
        size = max(abs(c) for c in coefficients)
        assert found[has] == pytest.approx(coefficients, rel=case.within, abs=1e-9 * size)
    wanted = _predicted(effect, case, case.terms, seen)
    off = _predicted(effect, case, list(found.items()), seen) - wanted
    assert np.any(wanted != 0.0)
    assert np.sqrt(np.mean(off**2)) <= case.within * np.sqrt(np.mean(wanted**2))


def test_every_entry_of_the_catalogue_has_a_case() -> None:
    assert set(ENTRIES) == {*CASES, *SCANNED}


@pytest.mark.parametrize("effect", CASES)
def test_identified_parameters_become_model_effects(
    tmp_path: Path, seen: RegressionData, effect: str
) -> None:
    # a column that is nothing would agree with anything
    stood = seen.motion._replace(dwell_s=np.where(seen.time_s > 2.0, 3.0, 0.5))
    strong = seen._replace(force_n=20.0 * seen.force_n, model_force_n=20.0 * seen.model_force_n)
    _holds(tmp_path, effect, CASES[effect], strong._replace(motion=stood))


@pytest.mark.parametrize("effect", SCANNED)
def test_shapes_of_the_recording_are_found_again(tmp_path: Path, seen: RegressionData, effect: str) -> None:
    _holds(tmp_path, effect, _with_scanned_shape(effect, SCANNED[effect], seen), seen)


@pytest.mark.parametrize("effect", WARM)
def test_drifts_over_a_recorded_temperature_are_found_again(
    tmp_path: Path, seen_warm: RegressionData, effect: str
) -> None:
    assert seen_warm.temperature_k is not None
    shape = (0.0, float(seen_warm.temperature_k[0]))
    [(_, coefficients)] = WARM[effect].terms
    _holds(tmp_path, effect, WARM[effect]._replace(terms=[(shape, coefficients)]), seen_warm)


def test_friction_that_builds_up_is_a_part_of_all_the_friction(tmp_path: Path, seen: RegressionData) -> None:
    """As the base's column has it, whose height the repairs have shared out."""
    updated_axis(tmp_path, "presliding_hysteresis", FORCE, [{"level_n": 5.0, "way_m": 8e-6}], seen)
    held, axis = _read(tmp_path / "model.toml")
    assert axis.coulomb_n == pytest.approx(BASE["coulomb_n"] - 5.0)
    assert baseline_parameters(axis) == pytest.approx(BASE)
    updated_axis(tmp_path, "payload_mass", FORCE, [{"mass_kg": 8.0}], seen)
    held, axis = _read(tmp_path / "model.toml")
    assert baseline_parameters(axis)["mass_kg"] == pytest.approx(BASE["mass_kg"])
    assert terms_of_model(axis._replace(model_effects=held), [seen]) == []


def test_the_contact_stiffness_of_a_backlash_is_no_compliance(tmp_path: Path, seen: RegressionData) -> None:
    case = CASES["backlash"]
    assert {k.effect for k in _read_back(tmp_path, "backlash", case, seen)} == {"backlash"}
