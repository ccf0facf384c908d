"""Identification of one residual channel of one axis: select terms, refine them, judge on held-out blocks."""

import math
from collections.abc import Container
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array, Index
from reconcile.catalogue.kinds import ResidualChannel, ShapeParameters
from reconcile.formats.nominal_axis import NominalAxis, baseline_parameters
from reconcile.identification.accounted import Accounted, accounted
from reconcile.identification.findings import IdentifiedEffect
from reconcile.identification.payload import payload
from reconcile.identification.term_search import FoundTerms, TermSearch
from reconcile.identification.unexplained_residual import unexplained_residual
from reconcile.regression.normal_equations import BlockNormalEquations, CandidateTerm
from reconcile.regression.regression_problem import RegressionProblem
from reconcile.regression.residual import Residual, residuals, rms
from reconcile.regression.residual_noise import noise_floor
from reconcile.selection.block_statistics import paired, threshold
from reconcile.selection.cross_validation import CrossValidation, SelectionRules
from reconcile.selection.left_out import Withdrawn


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
    rigid: dict[str, float] | None = None
    """Baseline parameters fitted without effects, SI; None in the deviation."""
    accounted: Accounted | None = None
    """What each part of the model gives; None where nothing was fitted."""
    withdrawn: tuple[Withdrawn, ...] = ()
    """Effects that were found and did not predict what was left out."""
    found: FoundTerms | None = None
    """Its inputs, to be refitted without some terms; None once the axis is done."""


def without(explanation: Explanation, effects: Container[str], *, brief: bool = False) -> Explanation:
    """The explanation without some effects, the rest fitted anew; `unknown` are those without a name."""
    found = explanation.found
    names = [f.effect for f in [*explanation.findings, *explanation.minor]]
    names += [c.effect for c in found.terms] if found else []
    if found is None or not any(name in effects for name in names):
        return explanation
    again = with_terms(explanation, found.without(effects), brief=brief)
    findings = [f for f in again.findings if f.effect not in effects]
    return again._replace(findings=findings, minor=[f for f in again.minor if f.effect not in effects])


def with_terms(explanation: Explanation, found: FoundTerms, *, brief: bool = False) -> Explanation:
    """The explanation by other terms; a `brief` one is only to be written, its figures stay as they were."""
    if not brief:
        return _explained(found)
    reported = _with_possible_values(found).report(resamples=0)
    return explanation._replace(
        findings=reported.findings,
        minor=reported.minor,
        base={name: estimate.value for name, estimate in reported.base.items()},
        timing=reported.timing,
        timing_s=reported.timing_s,
        found=found,
    )


def explain(search: TermSearch, left_out: Index | None = None) -> Explanation:
    """Identify the effects of one channel, from nothing of the blocks that are left out."""
    return _explained(search.found(left_out))


def _with_possible_values(found: FoundTerms) -> FoundTerms:
    """The terms beside no mass or friction that would drive the axis: what was below zero is held at zero.

    The rest is fitted to what is left then, rather than the value cut off behind the fit.
    """
    if found.of.channel is not ResidualChannel.FORCE:
        return found
    equations = found.problem.equations
    slots, held = equations.slots(found.terms), list[int]()
    totals = equations.totals(np.concatenate((found.train, found.held_out)))
    while True:
        values = equations.solve(slots, totals)[: len(equations.base)].tolist()
        negative = [k for k, value in enumerate(values) if value < 0.0 and k not in held]
        if not negative:
            return found._replace(problem=found.problem._replace(equations=equations))
        held.append(min(negative, key=lambda k: values[k]))
        equations = found.problem.equations.holding(held)


def _explained(found: FoundTerms) -> Explanation:
    axis, channel, rules, sources = found.of
    possible = _with_possible_values(found)
    reported = possible.report()
    equations, train = found.problem.equations, found.train
    baseline, totals = equations.slots([]), equations.totals(train)
    # a lag below a sample is how the channels were sampled, not physics: it is in all three models
    timing = [c for c in found.terms if reported.timing and c.effect == reported.timing[0]]
    refitted_theta = equations.solve(equations.slots(timing), totals)
    size = len(baseline)
    fitted = equations.denormalised(baseline, refitted_theta[:size])
    nominal_theta = _nominal(axis, found.problem, fitted) / equations.denormalised(baseline, np.ones(size))
    models = [
        (timing, np.append(nominal_theta, refitted_theta[size:])),
        (timing, refitted_theta),
        (found.terms, possible.problem.equations.solve(equations.slots(found.terms), totals)),
    ]
    before, refitted, after = (_residual_rms(equations, *model, train, found.held_out) for model in models)
    found_residuals = residuals(found.problem, sources, models, found.held_out)
    mass_kg, is_force = axis.mass_kg, channel is ResidualChannel.FORCE
    extra: list[IdentifiedEffect | None] = []
    if is_force:
        gains = (1.0 - (r / max(b, 1e-300)) ** 2 for b, r in zip(before, refitted, strict=True))
        extra.append(payload(reported.base, axis, *gains))
        mass_kg = reported.base["mass_kg"].value
    weights = equations.denormalised(equations.slots(found.terms), models[-1][1])
    floor = noise_floor(found_residuals, channel, mass_kg).rms
    sizes = accounted(
        found.problem,
        found.terms,
        weights,
        noise=floor,
        share=rules.matters,
    )
    nothing_matters = is_force and rms(found_residuals, "refitted") < sizes.least
    large = [
        f
        for f in reported.findings
        if sizes.matter(f.effect) and not (f.effect == "unknown" and nothing_matters)
    ]
    if not nothing_matters and not any(finding.effect == "unknown" for finding in large):
        resolution_m = max(axis.encoder_resolution_m or 0.0, axis.scale_resolution_m or 0.0)
        alone = not large and not any(extra)
        extra.append(unexplained_residual(found_residuals, channel, sizes, resolution_m, alone=alone))
    return Explanation(
        channel=channel,
        findings=[*large, *(finding for finding in extra if finding)],
        minor=[*reported.minor, *(f for f in reported.findings if f not in large)],
        before=before,
        refitted=refitted,
        after=after,
        base={name: estimate.value for name, estimate in reported.base.items()},
        timing=reported.timing,
        timing_s=reported.timing_s,
        parameters_matter=_rms_between(before, refitted) >= sizes.matters
        and refitted.heldout <= before.heldout  # of what was left out the nominal values are not worse
        and _nominal_values_refuted(equations, *models[0], train, rules),
        residuals=found_residuals,
        rigid=dict(zip(found.problem.baseline_names, fitted.tolist(), strict=True)) if is_force else None,
        withdrawn=tuple(found.withdrawn),
        accounted=sizes,
        found=found,
    )


def _rms_between(before: ResidualRms, refitted: ResidualRms) -> float:
    """RMS that refitting the values removes, N or m."""
    return math.sqrt(max(before.train**2 - refitted.train**2, 0.0))


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
