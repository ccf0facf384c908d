"""Identification of one residual channel of one axis: select terms, refine them, judge on held-out blocks."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array, Index
from reconcile.catalogue.conversion import ModelTerm
from reconcile.catalogue.kinds import RegressionData, ResidualChannel, ShapeParameters
from reconcile.formats.nominal_axis import NominalAxis, baseline_parameters
from reconcile.identification.findings import (
    IdentifiedEffect,
    ReportedEffects,
    RivalEffect,
    compare_rivals,
    report_findings,
)
from reconcile.identification.payload import payload
from reconcile.identification.refinement import refine
from reconcile.identification.unexplained_residual import unexplained_residual
from reconcile.recording.recording import AxisRecording
from reconcile.regression.model_presliding import regressed_terms
from reconcile.regression.normal_equations import BlockNormalEquations, CandidateTerm, effect_names
from reconcile.regression.regression_data import regression_data
from reconcile.regression.regression_problem import RegressionProblem, regression_problem
from reconcile.regression.residual import Residual, residuals, rms
from reconcile.regression.residual_noise import noise_floor
from reconcile.selection.cross_validation import CrossValidation, SelectionRules, paired, threshold
from reconcile.selection.stepwise_selection import select, select_beside_unnamed
from reconcile.selection.unnamed_selection import select_unnamed

STRETCH_BLOCKS, HELD_OUT_EVERY = 4, 4
"""Blocks of a stretch, and the period of held-out stretches: 25 % of the blocks judge the final model
only."""
NOISE_FLOOR_RATIO = 1.5
"""Residual RMS over the noise floor up to which no unnamed terms are tried."""


class ResidualRms(NamedTuple):
    """RMS of a residual, N or m, on the training blocks and on the held-out ones."""

    train: float
    heldout: float


class Explanation(NamedTuple):
    """What was identified in one channel of one axis."""

    channel: ResidualChannel
    findings: list[IdentifiedEffect]
    minor: list[IdentifiedEffect]
    """In the model, but too small or too uncertain to be reported."""
    before: ResidualRms
    """Of the nominal values."""
    refitted: ResidualRms
    """Of the refitted values, without effects."""
    after: ResidualRms
    """With the effects."""
    base: dict[str, float]
    """Baseline parameters, SI; of those free in each recording, the first one's."""
    timing: tuple[str, ShapeParameters] | None
    """Term that models a lag below one sample, if any."""
    timing_s: float
    """That lag; 0 without one."""
    parameters_matter: bool
    """The nominal values are worse than refitted ones, beyond chance."""
    residuals: list[Residual]
    """By recording."""


def explain(
    recordings: Sequence[AxisRecording], axis: NominalAxis, channel: ResidualChannel, rules: SelectionRules
) -> Explanation:
    """Identify the effects of one channel from all recordings of an axis."""
    datasets = [regression_data(recording, axis) for recording in recordings]
    model_terms = regressed_terms(axis, datasets, channel)
    sources = [recording.source for recording in recordings]
    found = _select_terms(datasets, channel, model_terms, rules)
    reported = _report(found)
    unnamed: list[tuple[str, ShapeParameters]] = []
    if not _is_noise(found, sources, axis):
        unnamed = select_unnamed(found.problem, found.refined, found.train, rules)
    if unnamed:
        beside = _select_terms(datasets, channel, model_terms, rules, unnamed, found.chosen)
        reported_beside = _report(beside)
        named = {finding.effect for finding in reported_beside.findings}
        # the second fit is kept only if no reported name is lost, or an unnamed term was accepted
        if "unknown" in named or named >= {finding.effect for finding in reported.findings}:
            found, reported = beside, reported_beside
    equations, train = found.problem.equations, found.train
    baseline, totals = equations.slots([]), equations.totals(train)
    # a lag below a sample is how the channels were sampled, not physics: it is in all three models
    timing = [c for c in found.refined if reported.timing and c.effect == reported.timing[0]]
    refitted_theta = equations.solve(equations.slots(timing), totals)
    size = len(baseline)
    fitted = equations.denormalised(baseline, refitted_theta[:size])
    nominal_theta = _nominal(axis, found.problem, fitted) / equations.denormalised(baseline, np.ones(size))
    models = [
        (timing, np.append(nominal_theta, refitted_theta[size:])),
        (timing, refitted_theta),
        (found.refined, equations.solve(equations.slots(found.refined), totals)),
    ]
    before, refitted, after = (_residual_rms(equations, *model, train, found.held_out) for model in models)
    found_residuals = residuals(found.problem, sources, models, found.held_out)
    mass_kg = axis.mass_kg
    findings: list[IdentifiedEffect | None] = [*reported.findings]
    if channel is ResidualChannel.FORCE:
        gains = (1.0 - (r / max(b, 1e-300)) ** 2 for b, r in zip(before, refitted, strict=True))
        findings.append(payload(reported.base, axis, *gains))
        mass_kg = reported.base["mass_kg"].value
    if not any(finding.effect == "unknown" for finding in reported.findings):
        findings.append(unexplained_residual(found_residuals, channel, mass_kg, axis.encoder_resolution_m))
    return Explanation(
        channel=channel,
        findings=[finding for finding in findings if finding],
        minor=reported.minor,
        before=before,
        refitted=refitted,
        after=after,
        base={name: estimate.value for name, estimate in reported.base.items()},
        timing=reported.timing,
        timing_s=reported.timing_s,
        parameters_matter=_nominal_values_refuted(equations, *models[0], train, rules),
        residuals=found_residuals,
    )


class _SelectedTerms(NamedTuple):
    """The selected terms, and the same terms with refined shape parameters."""

    chosen: list[CandidateTerm]
    rivals: dict[str, tuple[float, list[RivalEffect]]]
    train: Index
    held_out: Index
    problem: RegressionProblem
    refined: list[CandidateTerm]


def _report(found: _SelectedTerms) -> ReportedEffects:
    return report_findings(found.problem, found.refined, found.rivals, found.train, found.held_out)


def _is_noise(found: _SelectedTerms, sources: Sequence[str], axis: NominalAxis) -> bool:
    """Whether the residual is no more than the noise of the sensors."""
    equations, channel = found.problem.equations, found.problem.channel
    theta = equations.solve(equations.slots(found.refined), equations.totals(found.train))
    found_residuals = residuals(found.problem, sources, [(found.refined, theta)] * 3, found.held_out)
    floor = noise_floor(found_residuals, channel, axis.mass_kg).rms
    return rms(found_residuals, "after") <= NOISE_FLOOR_RATIO * floor


def _select_terms(
    datasets: Sequence[RegressionData],
    channel: ResidualChannel,
    model_terms: Sequence[ModelTerm],
    rules: SelectionRules,
    unnamed: Sequence[tuple[str, ShapeParameters]] = (),
    previous: Sequence[CandidateTerm] | None = None,
) -> _SelectedTerms:
    """Select terms, beside `unnamed` ones if given, and refine their shape parameters."""
    problem = regression_problem(datasets, channel, unnamed, model_terms=model_terms)
    train, held_out = _split(problem)
    validation = CrossValidation(problem.equations, train)
    problem.equations.rows.clear()  # the validation has copies; they take most of the memory
    if previous is None:
        chosen = select(validation, rules)
    else:
        own = problem.equations.by_key
        before, beside = [own[c.key] for c in previous], [own[*one, False] for one in unnamed]
        chosen = select_beside_unnamed(validation, rules, before, beside)
    rivals = {name: compare_rivals(validation, chosen, name) for name in effect_names(chosen)}
    del validation  # free its memory before the refinement
    return _SelectedTerms(chosen, rivals, train, held_out, *refine(problem, chosen, train))


def _split(problem: RegressionProblem) -> tuple[Index, Index]:
    """Training and held-out blocks: of each recording every fourth stretch is held out."""
    equations = problem.equations
    train, held_out = [], []
    for recording in range(equations.recordings):
        own = np.flatnonzero((equations.recording_of_block == recording) & (equations.samples > 0))
        is_held_out = np.arange(len(own)) // STRETCH_BLOCKS % HELD_OUT_EVERY == HELD_OUT_EVERY - 1
        train.append(own[~is_held_out])
        held_out.append(own[is_held_out])
    return np.concatenate(train), np.concatenate(held_out)


def _nominal(axis: NominalAxis, problem: RegressionProblem, fitted: Array) -> Array:
    """Baseline coefficients of the nominal model; origins, which it cannot have, as fitted."""
    if problem.channel is ResidualChannel.FORCE:
        nominal = baseline_parameters(axis)
        return np.array([nominal[name] for name in problem.baseline_names])
    names_of_slots = [problem.baseline_names[column] for column, _ in problem.equations.slots([])]
    return np.where([name == "origin_m" for name in names_of_slots], fitted, 0.0)


def _residual_rms(
    equations: BlockNormalEquations, chosen: list[CandidateTerm], theta: Array, train: Index, held_out: Index
) -> ResidualRms:
    slots = equations.slots(chosen)

    def rms(blocks: Index) -> float:
        count = max(int(equations.samples[blocks].sum()), 1)
        return math.sqrt(float(equations.squares(slots, theta, blocks).sum()) / count)

    return ResidualRms(rms(train), rms(held_out))


def _nominal_values_refuted(
    equations: BlockNormalEquations,
    timing: list[CandidateTerm],
    nominal: Array,
    train: Index,
    rules: SelectionRules,
) -> bool:
    """Whether refitted values predict held-back blocks better than the nominal ones, beyond chance."""
    validation = CrossValidation(equations, train)
    refitted, given = validation.cross_validated_squares(timing), validation.given(timing, nominal)
    t = paired(refitted, given)
    gain = 1.0 - float(refitted.sum()) / max(float(given.sum()), 1e-300)
    return t >= threshold(1, len(train), rules.false_alarm) and gain >= rules.least_parameters
