"""From chosen terms to findings: parameters with intervals, rivals, and effects too small to name."""

import math
from typing import Any

import numpy as np
import pytest
from formula_residuals import COULOMB_N, MASS_KG, problem

from reconcile.catalogue.kinds import RegressionData
from reconcile.identification import findings
from reconcile.identification.findings import report_findings
from reconcile.identification.parameter_estimates import Estimates, _percentile_interval, estimates
from reconcile.identification.rivals import compare_rivals
from reconcile.regression.candidate_term import CandidateTerm, effect_names
from reconcile.selection.cross_validation import CrossValidation

HARMONIC, COGGING_N, PHASE_RAD = 4.0, 3.0, 0.6


def cogging(data: object, amplitude_n: float = COGGING_N) -> np.ndarray:
    """The force on the motor is the opposite of what the motor needs."""
    angle = HARMONIC * 2.0 * math.pi * data.motion.position_m / data.lead_m + PHASE_RAD
    return -amplitude_n * np.sin(angle)


@pytest.fixture(scope="module")
def found() -> tuple:
    """A problem with cogging, its blocks, and its two candidates: the harmonic, and its neighbour."""
    given = problem(
        cogging, [("cogging", (HARMONIC,)), ("cogging", (HARMONIC + 1.0,)), ("constant_force", ())]
    )
    return given, np.flatnonzero(given.equations.samples)


def test_parameters_are_within_intervals_that_hold_the_truth(found: tuple) -> None:
    final, blocks = found
    chosen = [c for c in final.equations.candidates if c.shape_parameters == (HARMONIC,)]
    values = estimates(final, chosen, blocks)
    for name, truth in (("mass_kg", MASS_KG), ("coulomb_n", COULOMB_N)):
        value = values.base[name]
        assert value.value == pytest.approx(truth, rel=0.02)
        assert value.low < value.value < value.high
        assert value.high - value.low < 0.1 * truth
    own = values.of_term[chosen[0]]
    assert own["amplitude"].value == pytest.approx(COGGING_N, rel=0.03)
    assert own["amplitude"].low < COGGING_N < own["amplitude"].high
    assert own["phase_rad"].value == pytest.approx(PHASE_RAD, abs=0.03)


def test_nearly_collinear_columns_get_small_coefficients() -> None:
    """Two harmonics that are all but one: any difference of theirs fits, and only the small one elsewhere."""
    given = problem(cogging, [("cogging", (HARMONIC,)), ("cogging", (HARMONIC * 1.000003,))])
    equations, blocks = given.equations, np.flatnonzero(given.equations.samples)
    chosen = list(equations.candidates)
    slots = equations.slots(chosen)
    plain = equations.denormalised(slots, equations.solve(slots, equations.totals(blocks)))
    values = estimates(given, chosen, blocks, resamples=0)
    sizes = [values.of_term[c]["amplitude"].value for c in chosen]
    assert np.abs(plain[3:]).max() > 2.0 * COGGING_N
    assert max(sizes) < COGGING_N
    assert values.base["mass_kg"].value == pytest.approx(MASS_KG, rel=0.01)


def test_intervals_are_central_quantiles_and_angles_wrap() -> None:
    drawn = np.linspace(1.0, 3.0, 201).tolist()
    assert _percentile_interval(2.0, drawn, "coulomb_n") == pytest.approx((1.05, 2.95))
    turned = [(math.pi + 0.1 * k) % (2.0 * math.pi) for k in (-1.0, 0.0, 1.0)]
    low, high = _percentile_interval(-math.pi, turned, "phase_rad")  # the same angle, a turn away
    assert (low, high) == pytest.approx((-math.pi - 0.095, -math.pi + 0.095))


def test_gain_is_the_explained_residual_and_a_neighbouring_shape_is_no_rival(found: tuple) -> None:
    final, blocks = found
    validation = CrossValidation(final.equations, blocks)
    chosen = [c for c in final.equations.candidates if c.shape_parameters == (HARMONIC,)]
    gain, rivals = compare_rivals(validation, chosen, "cogging")
    without, beside = (float(validation.cross_validated_squares(terms).sum()) for terms in ([], chosen))
    assert gain == pytest.approx(1.0 - beside / without)
    assert gain > 0.9
    assert all(rival.confidence < 0.01 for rival in rivals)


def test_shapes_of_one_effect_are_one_finding() -> None:
    one, other = (CandidateTerm("presliding_hysteresis", (way,), False, (3,)) for way in (1e-5, 1e-4))
    between = CandidateTerm("cogging", (4.0,), False, (4, 5))
    assert effect_names([one, between, other]) == ["presliding_hysteresis", "cogging"]


def test_a_large_effect_is_named_and_a_small_one_is_minor(found: tuple) -> None:
    final, blocks = found
    held, train = blocks[3::4], np.setdiff1d(blocks, blocks[3::4])
    chosen = [
        c
        for c in final.equations.candidates
        if c.shape_parameters == (HARMONIC,) or c.effect == "constant_force"
    ]
    validation = CrossValidation(final.equations, train)
    contests = {name: compare_rivals(validation, chosen, name) for name in ("cogging", "constant_force")}
    report = report_findings(final, chosen, contests, train, held)
    assert [f.effect for f in report.findings] == ["cogging"]
    assert [f.effect for f in report.minor] == ["constant_force"]
    [named] = report.findings
    assert named.channel == "force"
    assert named.heldout_gain > 0.9
    assert named.confidence > 0.9
    assert named.candidates == [chosen[0]] or named.candidates == [chosen[1]]
    assert report.timing is None
    assert report.timing_s == 0.0


@pytest.mark.parametrize(("low_s", "is_named"), [(1e-3, True), (-1e-4, False)])
def test_a_delay_that_may_be_none_is_minor(
    monkeypatch: pytest.MonkeyPatch, low_s: float, *, is_named: bool
) -> None:
    def late(data: RegressionData) -> np.ndarray:
        return np.interp(data.time_s + 5e-3, data.time_s, data.model_force_n) - data.model_force_n

    final = problem(late, [("transport_delay", (5e-3,))])
    blocks = np.flatnonzero(final.equations.samples)
    chosen = [c for c in final.equations.candidates if not c.per_recording]
    held, train = blocks[3::4], np.setdiff1d(blocks, blocks[3::4])

    def with_low(*given: Any) -> Estimates:
        values = estimates(*given)
        [(term, own)] = values.of_term.items()
        assert own["time_s"].value == pytest.approx(5e-3, rel=0.1)
        return values._replace(of_term={term: {"time_s": own["time_s"]._replace(low=low_s)}})

    monkeypatch.setattr(findings, "estimates", with_low)
    report = report_findings(final, chosen, {"transport_delay": (0.9, [])}, train, held)
    assert [f.effect for f in (report.findings if is_named else report.minor)] == ["transport_delay"]
