"""What was found without a name is in the plant file, and is read back as the very same force.

The plant's own kernels give the force along the recorded motion; that is held against the terms' columns.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from synthetic_findings import BASE, FORCE, data, explanations, model_file

from hil_sim.config import load_plant
from hil_sim.physics.registry import EFFECTS
from kernels.arrays import Array
from kernels.quantities import section_of
from reconcile.catalogue.kinds import IN_A_RECORDING, RegressionData, ResidualChannel
from reconcile.catalogue.unnamed_terms import TERMS, term
from reconcile.identification.findings import IdentifiedEffect
from reconcile.identification.parameter_estimates import Estimate
from reconcile.model_update.axis_sections import axis_sections
from reconcile.nominal_model.model_effects import model_effects_of
from reconcile.nominal_model.model_file import load_model, write_model
from reconcile.nominal_model.model_terms import terms_of_model
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.regression_problem import predicted_by_model

MODULES = {section_of(effect): effect for effect in EFFECTS}
RNG = np.random.default_rng(5)
RUBBING = "[axis.x.viscous_friction]\nviscous_n_s_m = 100.0\n[axis.x.coulomb_friction]\ncoulomb_n = 12.0\n"
HELD = {
    "position": 16,
    "position_by_direction": 16,
    "position_of_the_damping": 16,
    "position_of_the_mass": 16,
    "velocity": 8,
    "speed_by_direction": 8,
    "run_time": 16,
    "run_time_by_direction": 16,
    "run_time_of_the_damping": 16,
    "run_time_of_the_mass": 16,
    "moment_of_force": 1,
    "moment_of_friction": 1,
    "moment_of_viscous_friction": 1,
    "moment_of_mass": 1,
    "relaxation": 1,
    "position_and_velocity": 62,
}
"""Terms that a plant holds, with their coefficients."""


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> RegressionData:
    return data(tmp_path_factory.mktemp("nominal"))


def found(name: str, coefficients: Array, seen: RegressionData) -> tuple[IdentifiedEffect, Array]:
    """As a diagnosis reports it, and the force that the motor needs for it."""
    unnamed = term(f"unknown:{name}")
    shape = unnamed.shapes([seen])[len(unnamed.shapes([seen])) // 2]
    parameters = {
        key: Estimate(value, value, value, unit)
        for key, (value, unit) in unnamed.parameters(shape, coefficients).items()
    }
    candidate = CandidateTerm(f"unknown:{name}", shape, False, (0,))
    finding = IdentifiedEffect("unknown", "force", 0.9, [], [], [candidate], parameters, 0.5, 0.5, "")
    return finding, unnamed.columns(seen, shape) @ coefficients


def written(folder: Path, findings: list[IdentifiedEffect], seen: RegressionData) -> tuple[Path, list[str]]:
    model = load_model(model_file(folder, RUBBING))
    made = axis_sections(explanations(FORCE, findings, seen), model, "x")
    write_model(model, {"x": made.sections}, folder / "model.toml")
    return folder / "model.toml", made.notes


def read_back(file: Path, seen: RegressionData) -> Array:
    """The force of the model's terms, beside mass, viscous and Coulomb friction."""
    model = load_model(file)
    axis = model.axes["x"]._replace(model_effects=model_effects_of(file, "x", model.document["axis"]))
    return predicted_by_model(seen, FORCE, terms_of_model(axis, [seen]))


@pytest.mark.parametrize("name", HELD)
def test_a_term_without_a_name_is_read_back_as_the_same_force(
    tmp_path: Path, seen: RegressionData, name: str
) -> None:
    finding, wanted_n = found(name, RNG.uniform(-3.0, 3.0, HELD[name]), seen)
    file, notes = written(tmp_path, [finding], seen)
    assert notes == []
    assert load_plant(file).axes["x"].effects.keys() >= {term(f"unknown:{name}").section}
    scale = float(np.abs(wanted_n).max())
    assert scale > 0.0
    assert read_back(file, seen) == pytest.approx(wanted_n, abs=1e-9 * scale)


@pytest.mark.parametrize("name", HELD)
def test_the_plants_own_law_makes_that_force(tmp_path: Path, seen: RegressionData, name: str) -> None:
    finding, wanted_n = found(name, RNG.uniform(-3.0, 3.0, HELD[name]), seen)
    file, _ = written(tmp_path, [finding], seen)
    section = term(f"unknown:{name}").section
    made_n = needed_n(MODULES[section], load_plant(file).axes["x"].effects[section], seen)
    moving = seen.motion.moving
    scale = float(np.abs(wanted_n).max())
    assert made_n[moving] == pytest.approx(wanted_n[moving], abs=2e-3 * scale)


def needed_n(effect: Any, p: Any, seen: RegressionData) -> Array:
    """What the motor needs for an effect along the motion, sample by sample, from its kernels alone."""
    m, force_n = seen.motion, np.zeros(len(seen.time_s))
    state = effect.State() if hasattr(effect, "State") else None
    memory = np.zeros(1, [("damper_m_s", np.float64)])[0] if state is not None else None
    for k, (t, x, v, a) in enumerate(
        zip(seen.time_s, m.position_m, m.velocity_m_s, m.acceleration_m_s2, strict=True)
    ):
        s = math.copysign(1.0, v)
        if effect.KIND.name == "TABLE_FORCE":
            force_n[k] = -effect.force_n(p, x, 1.0)
        elif effect.KIND.name == "STATE_FORCE":
            force_n[k] = -effect.force_n(p, x, v)
        elif effect.KIND.name == "FRICTION_POSITION":
            force_n[k] = s * effect.level_n(p, x)
        elif effect.KIND.name == "FRICTION_SPEED":
            force_n[k] = s * effect.level_n(p, v)
        elif effect.KIND.name == "CHANGE_IN_TIME":
            t_s = t - 1e-9  # the moment itself is before the change, as in the term
            force_n[k] = -effect.force_n(p, t_s) + s * effect.level_n(p, t_s)
            force_n[k] += v * effect.damping_n_s_m(p, t_s) + a * effect.added_kg(p, t_s)
        elif effect.KIND.name == "CHANGE_WITH_POSITION":
            force_n[k] = v * effect.damping_n_s_m(p, x) + a * effect.added_kg(p, x)
        else:
            effect.advance(p, memory, v, seen.period_s)
            force_n[k] = -effect.force_n(p, memory)
    return force_n


def test_findings_of_one_drift_share_its_section_and_two_events_do_not(
    tmp_path: Path, seen: RegressionData
) -> None:
    force, force_n = found("run_time", RNG.uniform(-3.0, 3.0, 16), seen)
    friction, friction_n = found("run_time_by_direction", RNG.uniform(-3.0, 3.0, 16), seen)
    file, notes = written(tmp_path, [force, friction], seen)
    assert notes == []
    assert read_back(file, seen) == pytest.approx(force_n + friction_n, abs=1e-8)
    step, step_n = found("moment_of_force", np.array([2.0]), seen)
    later = {key: one for key, one in step.parameters.items() if key != "moment_s"}
    other = step._replace(parameters={**later, "moment_s": Estimate(7.0, 7.0, 7.0, "s")})
    file, [note] = written(tmp_path, [step, other], seen)
    assert "the plant takes one step_in_time" in note
    assert read_back(file, seen) == pytest.approx(step_n, abs=1e-9)


def test_every_term_has_a_section_or_a_note_that_it_has_none(tmp_path: Path, seen: RegressionData) -> None:
    without = {name for name, one in TERMS[FORCE].items() if not one.section}
    of_one = {name for name in without if name.endswith(IN_A_RECORDING)}
    assert without - of_one == {"acceleration", "force", "distance_since_reversal", "moment_of_delay"}
    finding, _ = found("moment_of_delay", np.array([1e-3]), seen)
    _, [note] = written(tmp_path, [finding], seen)
    assert "it is in no catalogue, so no plant has it" in note


def test_a_curve_of_the_deviation_is_no_table_of_force(tmp_path: Path, seen: RegressionData) -> None:
    finding, _ = found("run_time", RNG.uniform(-1e-4, 1e-4, 16), seen)
    deviation = finding._replace(channel=ResidualChannel.POSITION_DEVIATION.value)
    file, [note] = written(tmp_path, [deviation], seen)
    assert "a plant has tables of forces only" in note
    assert not read_back(file, seen).any()


def test_a_mass_on_a_spring_is_taken_off_a_model_that_has_it(tmp_path: Path, seen: RegressionData) -> None:
    """Against the oscillator on a moving base, integrated in small steps."""
    mode = "[axis.x.structural_mode]\nmass_kg = 5.0\nfrequency_hz = 12.0\ndamping_ratio = 0.05\n"
    predicted_n = read_back(model_file(tmp_path, RUBBING + mode), seen)
    w, zeta, steps = 2.0 * math.pi * 12.0, 0.05, 20
    times_s = np.arange(len(seen.time_s) * steps) * seen.period_s / steps
    base_m_s2 = np.interp(times_s, seen.time_s, seen.motion.acceleration_m_s2)
    d = v = 0.0
    carried_n = np.zeros(len(times_s))
    for k, a in enumerate(base_m_s2):
        pull = w * w * d + 2.0 * zeta * w * v
        carried_n[k] = -5.0 * pull
        v += (-pull - a) * seen.period_s / steps
        d += v * seen.period_s / steps
    wanted_n = carried_n[::steps] - 5.0 * seen.motion.acceleration_m_s2  # the baseline has all the mass
    settled = seen.time_s > 2.0
    size = float(np.abs(wanted_n[settled]).max())
    assert predicted_n[settled] == pytest.approx(wanted_n[settled], abs=0.1 * size)


def test_ringing_becomes_a_carried_mass_only_in_phase(tmp_path: Path, seen: RegressionData) -> None:
    finding, _ = found("ringing", np.array([4.0, 0.2]), seen)
    file, notes = written(tmp_path, [finding], seen)
    assert notes == []
    assert load_plant(file).axes["x"].effects["structural_mode"].mass_kg == pytest.approx(4.0)
    finding, _ = found("ringing", np.array([-4.0, 0.2]), seen)
    _, [note] = written(tmp_path, [finding], seen)
    assert "otherwise than a carried mass" in note
    assert BASE["mass_kg"] > 4.0


def test_a_plants_spectrum_is_known_by_its_seed(tmp_path: Path, seen: RegressionData) -> None:
    lines = "[axis.x.disturbance_spectrum]\nfrequency_hz = [3.0, 7.0]\namplitude_n = [2.0, 1.0]\nseed = 5\n"
    file = model_file(tmp_path, RUBBING + lines)
    model = load_model(file)
    p = model_effects_of(file, "x", model.document["axis"]).effects["disturbance_spectrum"]
    wanted_n = [-MODULES["disturbance_spectrum"].force_n(p, float(t)) for t in seen.time_s]
    assert read_back(file, seen) == pytest.approx(wanted_n, abs=1e-9)
