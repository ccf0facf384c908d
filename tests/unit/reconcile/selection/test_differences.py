"""From samples to evidence: filter, kinematics, normal equations, selection, each against its definition."""

import math

import numpy as np
import pytest

from reconcile.catalogue.registry import ENTRIES
from reconcile.recording.kinematics import dahl_deflection, kinematics
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.normal_equations import BlockNormalEquations
from reconcile.regression.state_filter import StateFilter
from reconcile.selection.block_statistics import bonferroni_threshold
from reconcile.selection.cross_validation import CrossValidation
from reconcile.selection.selection_rules import SelectionRules
from reconcile.selection.stepwise_selection import select

T = 1e-3


@pytest.mark.parametrize("derivative", [0, 1, 2])
def test_a_filtered_sine_follows_the_transfer_function(derivative: int) -> None:
    t, w, corner = np.arange(3000) * T, 2.0 * math.pi * 7.0, 2.0 * math.pi * 60.0
    found = StateFilter(T, 60.0)(np.sin(w * t), derivative)
    response = (1j * w) ** derivative * (corner / (1j * w + corner)) ** 3
    expected = np.imag(response * np.exp(1j * w * t))
    assert np.abs(found - expected)[300:].max() < 5e-3 * abs(response)


def test_a_constant_passes_and_its_derivatives_are_nothing() -> None:
    low_pass, constant = StateFilter(T, 60.0), np.full(50, 3.0)
    assert low_pass(constant) == pytest.approx(3.0)
    assert low_pass(constant, 2) == pytest.approx(0.0)


def test_the_coordinates_of_a_sine_with_a_rest_in_it() -> None:
    t = np.arange(4000) * T
    x = np.where(t < 2.0, 0.01 * np.sin(math.pi * t), 0.0)  # one period, then a rest, then forwards
    x = np.where(t > 3.0, 0.01 * (t - 3.0), x)
    m = kinematics(np.round(x / 1e-8) * 1e-8, T)
    assert m.last_direction[250] == m.last_direction[1750] == 1.0
    assert m.last_direction[1000] == -1.0
    assert m.direction[[250, 1000, 1750, 3500]] == pytest.approx([1.0, -1.0, 1.0, 1.0])
    assert m.distance_since_reversal_m[1000] == pytest.approx(0.01, rel=0.01)
    assert m.standing_still[2100:2900].all()
    assert not m.standing_still[100:1900].any()
    assert m.dwell_s[3500] == pytest.approx(1.0, abs=0.05)
    assert m.distance_since_standstill_m[3500] == pytest.approx(0.005, rel=0.02)


def test_bristle_deflections_equal_dahls_closed_form() -> None:
    x = np.linspace(0.0, 1e-4, 500)
    assert dahl_deflection(x, 2e-5) == pytest.approx(1.0 - np.exp(-x / 2e-5), abs=1e-12)


def _ledger(
    noise: float = 0.1, size: float = 0.5, seed: int = 0
) -> tuple[BlockNormalEquations, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    columns = rng.normal(size=(4000, 12))
    recording = np.repeat([0, 1], 20)
    block = np.repeat(np.arange(40), 100)
    own = np.where(recording[block] == 0, 1.0, -1.0)
    y = (
        2.0 * columns[:, 0]
        + size * columns[:, 3]
        + size * own * columns[:, 4]
        + noise * rng.normal(size=4000)
    )
    candidates = [CandidateTerm(f"e{i}", (), own, (i,)) for i in range(1, 12) for own in (False, True)]
    equations = BlockNormalEquations([False], candidates, recording)
    for part in (slice(0, 2000), slice(2000, None)):
        rows = np.concatenate((y[part][None], columns[part].T))
        equations.add(rows, block[part], np.zeros(len(y[part])))
    equations.normalise()
    return equations, y, columns


def test_a_solve_is_least_squares_with_own_coefficients_in_each_recording() -> None:
    equations, y, columns = _ledger()
    chosen = [c for c in equations.candidates if (c.effect, c.per_recording) in {("e3", False), ("e4", True)}]
    slots = equations.slots(chosen)
    theta = equations.solve(slots, equations.totals(np.arange(40)))
    first = np.arange(4000) < 2000
    whole = np.stack((columns[:, 0], columns[:, 3], columns[:, 4] * first, columns[:, 4] * ~first), axis=1)
    expected, *_ = np.linalg.lstsq(whole, y, rcond=None)
    assert equations.denormalised(slots, theta) == pytest.approx(expected, rel=1e-6)
    rest = (y - whole @ expected).reshape(40, 100)
    assert equations.squares(slots, theta, np.arange(40)) == pytest.approx(np.sum(rest**2, axis=1), rel=1e-6)


def test_exactly_the_present_terms_are_selected() -> None:
    equations, *_ = _ledger()
    chosen = select(CrossValidation(equations, np.arange(40)), SelectionRules())
    assert {(c.effect, c.per_recording) for c in chosen} == {("e3", False), ("e4", True)}


def test_false_acceptance_of_noise_stays_at_its_stated_rate() -> None:
    found = 0
    for seed in range(30):
        equations, *_ = _ledger(size=0.0, seed=seed)
        found += len(select(CrossValidation(equations, np.arange(40)), SelectionRules(false_alarm=0.05)))
    assert found <= 4


def test_held_out_blocks_are_predicted_worse_than_fitted_ones() -> None:
    equations, *_ = _ledger()
    validation = CrossValidation(equations, np.arange(40))
    slots = equations.slots(equations.candidates[:8])
    seen = equations.squares(slots, equations.solve(slots, validation.totals), np.arange(40)).sum()
    assert validation.cross_validated_squares(equations.candidates[:8]).sum() > seen


def test_more_candidate_terms_need_more_evidence() -> None:
    assert bonferroni_threshold(300, 40, 0.01) > bonferroni_threshold(3, 40, 0.01) > 2.0


@pytest.mark.parametrize("name", sorted(ENTRIES))
def test_every_catalogue_entry_gives_parameters_and_meanings(name: str) -> None:
    entry = ENTRIES[name]
    shape = {"cogging": (3.0,), "dwell_dependent_breakaway": (1e-5, 1.0)}.get(name, (2.0, 0.1, 0.2))
    parameters = entry.parameters(shape, np.array([0.3, 0.4, 0.5]))
    text = entry.sentence({key: parameter.value for key, parameter in parameters.items()})
    assert len(text) > 40
    assert "nan" not in text
