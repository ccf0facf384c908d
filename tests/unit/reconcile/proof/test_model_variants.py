"""Models that compete to be written: an engineer's friction beside or in place of what was found."""

import math
from pathlib import Path

import numpy as np
import pytest
from nominal_model_text import WITHOUT_SCALE

from kernels.arrays import Array
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.identification.explain import Explanation, explain, with_terms
from reconcile.identification.term_search import TermSearch
from reconcile.nominal_model.model_file import load_model
from reconcile.proof.model_choice import with_refitted_values
from reconcile.proof.model_variants import AS_FOUND, VARIANTS, variants_of
from reconcile.proof.proof import HeldOutErrors, Proof
from reconcile.recording.recording import load_recordings
from reconcile.selection.selection_rules import SelectionRules

T, N = 2e-3, 4000
PULL_N, BY_DIRECTION_N_S_M = 4.0, 25.0


def explained(folder: Path, x: Array) -> Explanation:
    """Of an axis of 50 kg that is pulled, rubs more in one direction, and is shaken by a drifting force."""
    (folder / "nominal.toml").write_text(WITHOUT_SCALE, encoding="utf-8")
    rng, t = np.random.default_rng(3), np.arange(N) * T
    v, a = np.gradient(x, T), np.gradient(np.gradient(x, T), T)
    drift = np.interp(t, np.linspace(0.0, t[-1], 30), rng.normal(size=30))
    force = 50.0 * a + 100.0 * v + 12.0 * np.sign(v) + PULL_N + BY_DIRECTION_N_S_M * np.abs(v) + drift
    columns = np.stack((t, np.round(x / 5e-9) * 5e-9, force + rng.normal(size=N) * 0.2), axis=1)
    file = folder / "pulled.csv"
    np.savetxt(file, columns, delimiter=",", comments="", header="time_s,motor_position_m,motor_force_n")
    model = load_model(folder / "nominal.toml")
    recordings = load_recordings([file], model.axes)
    return explain(TermSearch(recordings, model.axes["x"], ResidualChannel.FORCE, SelectionRules()))


@pytest.fixture(scope="module")
def explanation(tmp_path_factory: pytest.TempPathFactory) -> Explanation:
    t = np.arange(N) * T
    x = 0.02 * np.sin(2.0 * math.pi * 0.4 * t) + 0.008 * np.sin(7.1 * t)
    return explained(tmp_path_factory.mktemp("variants"), x)


def test_textbook_friction_is_fitted(explanation: Explanation) -> None:
    made = VARIANTS["textbook friction"](explanation, True)
    by_name = {f.effect: f for f in [*made.findings, *made.minor]}
    assert by_name["constant_force"].parameters["force_n"].value == pytest.approx(-PULL_N, rel=0.25)
    viscous = by_name["asymmetric_viscous_friction"].parameters["half_difference_n_s_m"].value
    assert viscous == pytest.approx(BY_DIRECTION_N_S_M, rel=0.4)
    assert made.base["mass_kg"] == pytest.approx(50.0, rel=0.02)


def test_of_a_motion_in_one_direction_half_is_friction_and_half_a_constant_force(tmp_path: Path) -> None:
    """Nothing tells the two apart; the other direction is predicted with the least error at worst."""
    t = np.arange(N) * T
    one_way = explained(tmp_path, 0.06 * t + 0.008 * np.sin(5.0 * t))
    for name in ("textbook friction", "beside textbook friction"):
        made = VARIANTS[name](one_way, True)
        constant = {f.effect: f for f in [*made.findings, *made.minor]}["constant_force"]
        pulled_n = -constant.parameters["force_n"].value
        assert pulled_n == pytest.approx(made.base["coulomb_n"], rel=0.1)
        assert pulled_n + made.base["coulomb_n"] == pytest.approx(12.0 + PULL_N, rel=0.15)


def test_beside_it_all_that_was_found_stays(explanation: Explanation) -> None:
    assert AS_FOUND not in variants_of(explanation)
    assert explanation.selected is not None
    made = variants_of(explanation)["beside textbook friction"](explanation, True)
    assert made.selected is not None
    kept = {c.key for c in explanation.selected.terms if not c.per_recording}
    assert kept <= {c.key for c in made.selected.terms}
    assert len(made.selected.terms) > len(kept)


def test_a_table_over_the_travel_is_fitted_beside_the_friction(explanation: Explanation) -> None:
    made = VARIANTS["textbook friction and a table over the travel"](explanation, True)
    assert made.selected is not None
    assert "unknown:position" in {c.effect for c in made.selected.terms}
    assert VARIANTS["textbook friction and a weight"](explanation, True) is explanation  # no joint


def test_a_force_over_the_places_competes_only_where_another_recording_judges_it(
    explanation: Explanation,
) -> None:
    assert not [name for name in variants_of(explanation) if name.endswith(("weight", "travel"))]


def test_nothing_without_a_name_is_reported_where_a_rigid_model_leaves_a_negligible_residual(
    explanation: Explanation,
) -> None:
    selected = explanation.selected
    assert selected is not None
    assert explanation.accounted is not None
    share = explanation.refitted.train / explanation.accounted.measured

    def reported(negligible_share: float) -> set[str]:
        inputs = selected.inputs._replace(rules=SelectionRules(negligible_force_share=negligible_share))
        nameless = selected.without({c.effect for c in selected.terms})._replace(inputs=inputs)
        return {f.effect for f in with_terms(explanation, nameless).findings}

    assert reported(0.9 * share) == {"unknown"}
    assert reported(1.1 * share) == set()


def test_a_force_that_mass_and_friction_imitate_is_not_named_however_large_it_is(tmp_path: Path) -> None:
    """Along a motion in one direction it takes the place of Coulomb friction, and removes next to nothing."""
    t = np.arange(N) * T
    one_way = explained(tmp_path, 0.06 * t + 0.008 * np.sin(5.0 * t))
    made = VARIANTS["textbook friction"](one_way, True)
    assert made.selected is not None
    reported = with_terms(one_way, made.selected)
    assert reported.accounted is not None
    assert reported.accounted.effects["constant_force"] > 5.0
    assert reported.refitted.train - reported.after.train < reported.accounted.negligible_rms
    assert [f.effect for f in reported.findings] == ["unknown"]
    assert "constant_force" in [f.effect for f in reported.minor]


@pytest.mark.parametrize(("written_n", "is_worse"), [(1.05, True), (1.01, False), (0.5, False)])
def test_nominal_values_are_not_written_where_refitted_ones_predicted_better(
    explanation: Explanation, written_n: float, is_worse: bool
) -> None:
    part = HeldOutErrors("0.csv", ResidualChannel.FORCE, 1000, measured=9.0, rigid=1.0, written=written_n)
    proof = Proof(ResidualChannel.FORCE, [part, part], is_last_third=False)
    nominal = explanation._replace(nominal_is_worse=False)
    assert with_refitted_values(nominal, proof).nominal_is_worse == is_worse
    sizes = explanation.accounted
    assert sizes is not None
    quiet = nominal._replace(accounted=sizes._replace(noise=sizes.residual))
    assert quiet.accounted is not None
    assert quiet.accounted.is_noise
    assert not with_refitted_values(quiet, proof).nominal_is_worse
