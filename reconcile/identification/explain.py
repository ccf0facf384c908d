"""Identification of one residual channel of one axis: select terms, refine them, judge on held-out blocks."""

import math
from collections.abc import Container, Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array, Index
from reconcile.catalogue.kinds import ResidualChannel, ShapeParameters
from reconcile.identification.accounted import Accounted, accounted
from reconcile.identification.compared_models import compared_models
from reconcile.identification.findings import IdentifiedEffect, ReportedEffects
from reconcile.identification.payload import mass_bias_kg, payload
from reconcile.identification.term_search import FoundTerms, TermSearch
from reconcile.identification.unexplained_residual import unexplained_residual
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.normal_equations import BlockNormalEquations
from reconcile.regression.residual import Residual, residuals, rms
from reconcile.regression.residual_noise import noise_floor
from reconcile.selection.block_statistics import bonferroni_threshold, log_ratio_t
from reconcile.selection.cross_validation import CrossValidation
from reconcile.selection.predictive_terms import WithdrawnEffect
from reconcile.selection.selection_rules import SelectionRules


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
    """RMS of each part of the model; None where nothing was fitted."""
    withdrawn: tuple[WithdrawnEffect, ...] = ()
    """Effects that were selected and then rejected, with the reason."""
    found: FoundTerms | None = None
    """The terms and the data that they were found on, for a refit without some of them; None once the axis is
    done."""


def without(explanation: Explanation, effects: Container[str], *, brief: bool = False) -> Explanation:
    """The explanation without some effects, the others refitted; `unknown` stands for all unnamed terms."""
    found = explanation.found
    names = [f.effect for f in [*explanation.findings, *explanation.minor]]
    names += [c.effect for c in found.terms] if found else []
    if found is None or not any(name in effects for name in names):
        return explanation
    again = with_terms(explanation, found.without(effects), brief=brief)
    findings = [f for f in again.findings if f.effect not in effects]
    return again._replace(findings=findings, minor=[f for f in again.minor if f.effect not in effects])


def with_terms(explanation: Explanation, found: FoundTerms, *, brief: bool = False) -> Explanation:
    """The explanation by other terms; `brief`: for a model file alone, its figures are not computed again."""
    if not brief:
        return _explained(found)
    reported = _with_non_negative_baseline(found).report(resamples=0)
    return explanation._replace(
        findings=reported.findings,
        minor=reported.minor,
        base={name: estimate.value for name, estimate in reported.base.items()},
        timing=reported.timing,
        timing_s=reported.timing_s,
        found=found,
    )


def explain(search: TermSearch, left_out: Index | None = None) -> Explanation:
    """Identify the effects of one channel, without any use of the blocks that are left out."""
    return _explained(search.found(left_out))


def _with_non_negative_baseline(found: FoundTerms) -> FoundTerms:
    """The terms with a baseline of no negative mass or friction, which would drive the axis.

    A negative coefficient is held at zero and the others are refitted; clipped after the fit, it would bias
    them.
    """
    if found.inputs.channel is not ResidualChannel.FORCE:
        return found
    equations = found.problem.equations
    slots, held = equations.slots(found.terms), list[int]()
    totals = equations.totals(np.concatenate((found.train, found.held_out)))
    while True:
        values = equations.solve(slots, totals)[: len(equations.baseline_is_free)].tolist()
        negative = [k for k, value in enumerate(values) if value < 0.0 and k not in held]
        if not negative:
            return found._replace(problem=found.problem._replace(equations=equations))
        held.append(min(negative, key=lambda k: values[k]))
        equations = found.problem.equations.held_at_zero(held)


def _explained(found: FoundTerms) -> Explanation:
    """Fit the three models, compare their residuals, and report the effects that are large enough."""
    axis, channel, rules, sources = found.inputs
    admissible = _with_non_negative_baseline(found)
    reported = admissible.report()
    equations, train = found.problem.equations, found.train
    models = compared_models(found, admissible, reported.timing)
    before, refitted, after = (_residual_rms(equations, *model, train, found.held_out) for model in models)
    found_residuals = residuals(found.problem, sources, models, found.held_out)
    is_force = channel is ResidualChannel.FORCE
    mass_kg = reported.base["mass_kg"].value if is_force else axis.mass_kg
    sizes = accounted(
        found.problem,
        found.terms,
        equations.denormalised(equations.slots(found.terms), models[-1][1]),
        noise=noise_floor(found_residuals, channel, mass_kg).rms,
        share=rules.negligible_force_share,
    )
    added_mass = None
    if is_force:
        gains = (1.0 - (r / max(b, 1e-300)) ** 2 for b, r in zip(before, refitted, strict=True))
        bias_kg = mass_bias_kg(found.problem, sizes.unexplained)
        added_mass = payload(reported.base, axis, *gains, bias_kg=bias_kg)
    large, beside_terms = _findings(found, reported, found_residuals, sizes, added_mass)
    rigid = equations.denormalised(equations.slots([]), models[1][1][: len(equations.slots([]))])
    return Explanation(
        channel=channel,
        findings=[*large, *beside_terms],
        minor=[*reported.minor, *(f for f in reported.findings if f not in large)],
        before=before,
        refitted=refitted,
        after=after,
        base={name: estimate.value for name, estimate in reported.base.items()},
        timing=reported.timing,
        timing_s=reported.timing_s,
        parameters_matter=_rms_between(before, refitted) >= sizes.matters
        and refitted.heldout <= before.heldout
        and _nominal_values_are_worse(equations, *models[0], train, rules),
        residuals=found_residuals,
        rigid=dict(zip(found.problem.baseline_names, rigid.tolist(), strict=True)) if is_force else None,
        withdrawn=tuple(found.withdrawn),
        accounted=sizes,
        found=found,
    )


def _findings(
    found: FoundTerms,
    reported: ReportedEffects,
    found_residuals: Sequence[Residual],
    sizes: Accounted,
    added_mass: IdentifiedEffect | None,
) -> tuple[list[IdentifiedEffect], list[IdentifiedEffect]]:
    """The reported effects that are large enough; and the payload and the unexplained residual, if any."""
    axis, channel = found.inputs.axis, found.inputs.channel
    nothing_matters = (
        channel is ResidualChannel.FORCE and rms(found_residuals, "refitted") < sizes.least_reported
    )
    large = [
        f
        for f in reported.findings
        if sizes.is_relevant(f.effect) and not (f.effect == "unknown" and nothing_matters)
    ]
    beside_terms = [added_mass] if added_mass else []
    if not nothing_matters and not any(finding.effect == "unknown" for finding in large):
        resolution_m = max(axis.encoder_resolution_m or 0.0, axis.scale_resolution_m or 0.0)
        alone = not large and not beside_terms
        unexplained = unexplained_residual(found_residuals, channel, sizes, resolution_m, alone=alone)
        beside_terms += [unexplained] if unexplained else []
    return large, beside_terms


def _rms_between(before: ResidualRms, refitted: ResidualRms) -> float:
    """RMS that refitting the values removes, N or m."""
    return math.sqrt(max(before.train**2 - refitted.train**2, 0.0))


def _residual_rms(
    equations: BlockNormalEquations, chosen: list[CandidateTerm], theta: Array, train: Index, held_out: Index
) -> ResidualRms:
    slots = equations.slots(chosen)

    def rms(blocks: Index) -> float:
        count = max(int(equations.samples[blocks].sum()), 1)
        return math.sqrt(float(equations.squares(slots, theta, blocks).sum()) / count)

    return ResidualRms(rms(train), rms(held_out))


def _nominal_values_are_worse(
    equations: BlockNormalEquations,
    timing: list[CandidateTerm],
    nominal: Array,
    train: Index,
    rules: SelectionRules,
) -> bool:
    """Whether refitted values predict left-out folds significantly better than the nominal ones."""
    validation = CrossValidation(equations, train)
    refitted, given = validation.cross_validated_squares(timing), validation.squares_at(timing, nominal)
    t = log_ratio_t(refitted, given)
    gain = 1.0 - float(refitted.sum()) / max(float(given.sum()), 1e-300)
    return t >= bonferroni_threshold(1, len(train), rules.false_alarm) and gain >= rules.least_refit_gain
