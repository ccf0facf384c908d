"""Identification of one residual channel of one axis: select terms, refine them, judge on held-out blocks."""

import math
from collections.abc import Container, Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array, Index
from reconcile.catalogue.kinds import ResidualChannel, ShapeParameters
from reconcile.formats.nominal_axis import baseline_parameters
from reconcile.identification.accounted import Accounted, accounted
from reconcile.identification.compared_models import compared_models
from reconcile.identification.findings import IdentifiedEffect, ReportedEffects
from reconcile.identification.payload import mass_bias_kg, payload
from reconcile.identification.selected_terms import SelectedTerms
from reconcile.identification.term_search import TermSearch
from reconcile.identification.unexplained_residual import unexplained_residual
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.normal_equations import BlockNormalEquations
from reconcile.regression.residual import Residual, residuals, rms, rms_between
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
    nominal_is_worse: bool
    """Nominal values predict significantly worse than refitted ones, by more than a negligible force."""
    residuals: list[Residual]
    """By recording."""
    rigid: dict[str, float] | None = None
    """Baseline parameters fitted without effects, SI; None in the deviation."""
    accounted: Accounted | None = None
    """RMS of each part of the model; None where nothing was fitted."""
    withdrawn: tuple[WithdrawnEffect, ...] = ()
    """Effects that were selected and then rejected, with the reason."""
    selected: SelectedTerms | None = None
    """The terms and the data of their fit, for a refit without some of them; None once the axis is done."""


def without(
    explanation: Explanation, effects: Container[str], *, parameters_only: bool = False
) -> Explanation:
    """The explanation without some effects, the others refitted; `unknown` stands for all unnamed terms."""
    selected = explanation.selected
    names = [f.effect for f in [*explanation.findings, *explanation.minor]]
    names += [c.effect for c in selected.terms] if selected else []
    if selected is None or not any(name in effects for name in names):
        return explanation
    again = with_terms(explanation, selected.without(effects), parameters_only=parameters_only)
    findings = [f for f in again.findings if f.effect not in effects]
    return again._replace(findings=findings, minor=[f for f in again.minor if f.effect not in effects])


def with_terms(
    explanation: Explanation, selected: SelectedTerms, *, parameters_only: bool = False
) -> Explanation:
    """The explanation by other terms.

    With `parameters_only`, residuals and RMS values stay those of the given explanation: a model file needs
    neither.
    """
    if not parameters_only:
        return _explained(selected)
    reported = _with_non_negative_baseline(selected).report(resamples=0)
    return explanation._replace(
        findings=reported.findings,
        minor=reported.minor,
        base={name: estimate.value for name, estimate in reported.base.items()},
        timing=reported.timing,
        timing_s=reported.timing_s,
        selected=selected,
    )


def explain(search: TermSearch, left_out: Index | None = None) -> Explanation:
    """Identify the effects of one channel, without any use of the blocks that are left out."""
    return _explained(search.select_terms(left_out))


def _with_non_negative_baseline(selected: SelectedTerms) -> SelectedTerms:
    """The terms with a baseline of no negative mass or friction, which would drive the axis.

    Where a coefficient is negative, the motion does not tell it: the mass is held at that of the model,
    friction at zero, and the others are refitted; clipped after the fit, it would bias them.
    """
    if selected.inputs.channel is not ResidualChannel.FORCE:
        return selected
    equations = selected.problem.equations
    slots, held = equations.slots(selected.terms), dict[int, float]()
    totals = equations.totals(np.concatenate((selected.train, selected.held_out)))
    names = selected.problem.baseline_names
    of_model = {"mass_kg": baseline_parameters(selected.inputs.axis)["mass_kg"]}
    while True:
        values = equations.solve(slots, totals)[: len(names)].tolist()
        negative = [k for k, value in enumerate(values) if value < 0.0 and k not in held]
        if not negative:
            return selected._replace(problem=selected.problem._replace(equations=equations))
        worst = min(negative, key=lambda k: values[k])
        held[worst] = of_model.get(names[worst], 0.0)
        equations = selected.problem.equations.held(held)


def _explained(selected: SelectedTerms) -> Explanation:
    """Fit the three models, compare their residuals, and report the effects that are large enough."""
    axis, channel, rules, sources = selected.inputs
    admissible = _with_non_negative_baseline(selected)
    reported = admissible.report()
    equations, train = selected.problem.equations, selected.train
    models = compared_models(selected, admissible, reported.timing)
    before, refitted, after = (_residual_rms(equations, *model, train, selected.held_out) for model in models)
    all_residuals = residuals(selected.problem, sources, models, selected.held_out)
    is_force = channel is ResidualChannel.FORCE
    mass_kg = reported.base["mass_kg"].value if is_force else axis.mass_kg
    sizes = accounted(
        selected.problem,
        selected.terms,
        equations.denormalised(equations.slots(selected.terms), models[-1][1]),
        noise=noise_floor(all_residuals, channel, mass_kg).rms,
        share=rules.negligible_force_share,
    )
    added_mass = None
    if is_force:
        gains = (1.0 - (r / max(b, 1e-300)) ** 2 for b, r in zip(before, refitted, strict=True))
        bias_kg = mass_bias_kg(selected.problem, sizes.unexplained)
        added_mass = payload(reported.base, axis, *gains, bias_kg=bias_kg)
    large, beside_terms = _findings(selected, reported, all_residuals, sizes, added_mass)
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
        nominal_is_worse=rms_between(before.train, refitted.train) >= sizes.negligible_rms
        and refitted.heldout <= before.heldout
        and _nominal_values_are_worse(equations, *models[0], train, rules),
        residuals=all_residuals,
        rigid=dict(zip(selected.problem.baseline_names, rigid.tolist(), strict=True)) if is_force else None,
        withdrawn=tuple(selected.withdrawn),
        accounted=sizes,
        selected=selected,
    )


def _findings(
    selected: SelectedTerms,
    reported: ReportedEffects,
    all_residuals: Sequence[Residual],
    sizes: Accounted,
    added_mass: IdentifiedEffect | None,
) -> tuple[list[IdentifiedEffect], list[IdentifiedEffect]]:
    """The reported effects that are large enough; and the payload and the unexplained residual, if any.

    A force is named by what it removes from the residual of the refitted rigid model: one that mass and
    friction imitate may be large beside them.
    """
    axis, channel = selected.inputs.axis, selected.inputs.channel
    is_force = channel is ResidualChannel.FORCE
    refitted_rms = rms(all_residuals, "refitted")
    rigid_suffices = is_force and refitted_rms < sizes.least_reported
    removed = rms_between(refitted_rms, rms(all_residuals, "after"))
    large = [
        f
        for f in reported.findings
        if sizes.is_relevant(f.effect)
        and not (f.effect == "unknown" and rigid_suffices)
        and not (is_force and removed < sizes.negligible_rms)
    ]
    beside_terms = [added_mass] if added_mass else []
    if not rigid_suffices and not any(finding.effect == "unknown" for finding in large):
        resolution_m = max(axis.encoder_resolution_m or 0.0, axis.scale_resolution_m or 0.0)
        alone = not large and not beside_terms
        unexplained = unexplained_residual(all_residuals, channel, sizes, resolution_m, alone=alone)
        beside_terms += [unexplained] if unexplained else []
    return large, beside_terms


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
