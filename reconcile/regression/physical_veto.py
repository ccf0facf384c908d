"""The veto of physics on the terms of a fitted regression problem, by effect."""

from collections.abc import Sequence

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelTerm
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.registry import ENTRIES
from reconcile.catalogue.relaxation_terms import RINGING_EFFECT
from reconcile.catalogue.veto import VetoContext, veto
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.regression.candidate_term import CandidateTerm, effect_names
from reconcile.regression.filter_ends import FILTER_HZ
from reconcile.regression.regression_data import target_and_baseline
from reconcile.regression.regression_problem import RegressionProblem


def vetoed(
    problem: RegressionProblem,
    chosen: Sequence[CandidateTerm],
    weights: Array,
    axis: NominalAxis,
    *,
    to_be_named: bool = True,
) -> dict[str, str]:
    """Return why effects among the `chosen` terms are impossible; those that physics admits are not in it.

    `weights` (k,): coefficients of the columns before normalisation, as `equations.slots(chosen)`.
    Coefficients that are free in each recording are judged by those of the first one. A level of a recording
    is Coulomb friction there; only what drifts is held against the baseline. Effects `to_be_named` must also
    be told apart from the baseline.
    """
    slots = problem.equations.slots(chosen)
    terms: dict[str, list[ModelTerm]] = {}
    places: dict[str, list[int]] = {}
    for candidate, own in problem.equations.placed(chosen):
        if candidate.effect in ENTRIES:
            values = tuple(float(value) for value in weights[own.start : own.start + len(candidate.columns)])
            term = ModelTerm(candidate.effect, candidate.shape_parameters, values, problem.channel)
            terms.setdefault(candidate.effect, []).append(term)
            changing = [i for i in own if slots[i][0] not in candidate.levels]
            places.setdefault(candidate.effect, []).extend(changing)
    base = {}
    if problem.channel is ResidualChannel.FORCE:
        base = dict(zip(problem.baseline_names, weights.tolist(), strict=False))
    parts = _filtered(problem, slots, weights, places)
    reasons = {}
    for effect in effect_names([c for c in chosen if c.effect in ENTRIES]):
        context = VetoContext(
            datasets=problem.datasets,
            axis=axis,
            base=base,
            model=[*problem.model_terms, *(term for own in terms.values() for term in own)],
            highest_hz=min(FILTER_HZ, 0.5 / problem.datasets[0].period_s),
            prediction=parts[effect],
            baseline=parts[""] if to_be_named else None,
        )
        if reason := veto(ENTRIES[effect], terms[effect], context):
            reasons[effect] = reason
    return reasons


def moved_kg(problem: RegressionProblem, chosen: Sequence[CandidateTerm], totals: Array) -> float:
    """Return the fitted mass (kg) beside `chosen` terms, with what swings on a spring, which is moved too.

    `totals`: of the blocks to fit, as `equations.totals`.
    """
    equations = problem.equations
    slots = equations.slots(chosen)
    weights = equations.denormalised(slots, equations.solve(slots, totals))
    swinging = (own.start for one, own in equations.placed(chosen) if one.effect == RINGING_EFFECT)
    # its part in phase has unit gain at zero frequency
    return float(sum((weights[in_phase] for in_phase in swinging), weights[0]))


def _filtered(
    problem: RegressionProblem, slots: Sequence[tuple[int, int]], weights: Array, places: dict[str, list[int]]
) -> dict[str, Array]:
    """Prediction (n,) of each effect, and the baseline's columns (n, k) by "", in the samples in use."""
    found: dict[str, list[Array]] = {effect: [] for effect in ("", *places)}
    for recording in range(problem.equations.recordings):
        used, data = problem.used[recording], problem.datasets[recording]
        found[""].append(target_and_baseline(data, problem.channel)[1][used])
        for effect, own in places.items():
            here = [(slots[i][0], float(weights[i])) for i in own if slots[i][1] in (-1, recording)]
            found[effect].append(problem.prediction(recording, here)[used])
    return {effect: np.concatenate(parts) for effect, parts in found.items()}
