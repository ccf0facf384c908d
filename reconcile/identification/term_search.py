"""The search for terms in one residual channel of one axis, on all recordings or without one of them.

The columns of all candidates are computed once. A search on fewer recordings uses the same columns and only
the blocks of those, so that names, shapes and coefficients come from these recordings alone.
"""

from collections.abc import Container, Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Index
from reconcile.catalogue.gravity import ENTRY as GRAVITY_ENTRY
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.smooth_terms import KNOTS, PREFIX
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.identification.findings import ReportedEffects, report_findings
from reconcile.identification.held_out_blocks import training_and_held_out
from reconcile.identification.parameter_estimates import RESAMPLES
from reconcile.identification.refinement import refine
from reconcile.identification.rivals import RivalEffect, compare_rivals
from reconcile.recording.recording import AxisRecording
from reconcile.regression.candidate_term import CandidateTerm, TermKey, effect_names
from reconcile.regression.model_presliding import regressed_terms
from reconcile.regression.physical_veto import moved_kg, vetoed
from reconcile.regression.regression_data import regression_data
from reconcile.regression.regression_problem import RegressionProblem, extended, regression_problem
from reconcile.regression.residual import residuals, rms
from reconcile.regression.residual_noise import noise_floor
from reconcile.selection.cross_validation import CrossValidation
from reconcile.selection.predictive_terms import WithdrawnEffect, predictive_terms
from reconcile.selection.selection_rules import SelectionRules
from reconcile.selection.stepwise_selection import select, select_beside_unnamed
from reconcile.selection.unnamed_selection import select_unnamed

NOISE_FLOOR_RATIO = 1.5
"""Residual RMS over the noise floor up to which no unnamed terms are tried."""
MOST_SEARCHES = 3
"""Searches, each without the effects that were withdrawn after the one before. Chosen."""
GRAVITY = GRAVITY_ENTRY.name
LEAST_MASS_SHARE = 0.3
"""Least mass fitted beside the effects, over that of a rigid model with gravity; if less, an effect has
absorbed the inertia. Chosen: plausible forces take far less from the fitted mass than this."""
LEAST_NOMINAL_SHARE = 0.01
"""The same over the nominal mass, which may be far off; chosen."""


class SearchInputs(NamedTuple):
    """The axis, channel and recordings of a search, and the rules of selection."""

    axis: NominalAxis
    channel: ResidualChannel
    rules: SelectionRules
    sources: list[str]
    """By recording."""


class FoundTerms(NamedTuple):
    """The selected terms of a channel, and the data that they were found on."""

    inputs: SearchInputs
    problem: RegressionProblem
    """Of these terms alone, with their refined shape parameters."""
    terms: list[CandidateTerm]
    train: Index
    held_out: Index
    rivals: dict[str, tuple[float, list[RivalEffect]]]
    withdrawn: list[WithdrawnEffect]

    def without(self, effects: Container[str]) -> "FoundTerms":
        """The same without some effects; `unknown` are all terms that have no name."""
        kept = [c for c in self.terms if _name(c) not in effects and c.effect not in effects]
        rivals = {effect: of for effect, of in self.rivals.items() if any(c.effect == effect for c in kept)}
        return self._replace(terms=kept, rivals=rivals)

    def report(self, resamples: int = RESAMPLES) -> ReportedEffects:
        """Parameters, rivals and confidence of each effect; without `resamples` no intervals."""
        return report_findings(
            problem=self.problem,
            chosen=self.terms,
            rivals=self.rivals,
            train=self.train,
            held_out_blocks=self.held_out,
            resamples=resamples,
        )


class _Selection(NamedTuple):
    found: FoundTerms
    chosen: list[CandidateTerm]
    """In the wide problem, before their shapes were refined."""


class TermSearch:
    """The recordings of an axis in one channel, with the columns of every candidate term."""

    def __init__(
        self,
        recordings: Sequence[AxisRecording],
        axis: NominalAxis,
        channel: ResidualChannel,
        rules: SelectionRules,
    ) -> None:
        self.axis, self.channel, self.rules = axis, channel, rules
        self.sources = [recording.source for recording in recordings]
        self._inputs = SearchInputs(axis, channel, rules, self.sources)
        common = set.intersection(*(set(recording.others) for recording in recordings))
        datasets = [
            regression_data(one._replace(others={name: one.others[name] for name in sorted(common)}), axis)
            for one in recordings
        ]  # a term of another axis has the same columns in all
        model_terms = regressed_terms(axis, datasets, channel)
        self.problem = regression_problem(
            datasets, channel, model_terms=model_terms, spare=rules.most_unnamed_terms * max(KNOTS)
        )
        self._train, self._held_out = training_and_held_out(self.problem)

    def release(self) -> None:
        """Give the columns' memory back; only the blocks of samples are still known."""
        self.problem.equations.release()

    def found(self, left_out: Index | None = None) -> FoundTerms:
        """Search the terms; on nothing of the blocks that are left out."""
        train, held_out = (
            blocks if left_out is None else blocks[~np.isin(blocks, left_out)]
            for blocks in (self._train, self._held_out)
        )
        one = self._select(self.problem, train, held_out)
        if self._is_noise(one.found):
            return one.found
        unnamed = select_unnamed(one.found.problem, one.found.terms, train, self.rules)
        if not unnamed:
            return one.found
        beside = self._select_beside(unnamed, one)
        named, before = (
            {f.effect for f in found.report(resamples=0).findings} for found in (beside, one.found)
        )
        # the second fit is kept only if no reported name is lost, or an unnamed term was accepted
        return beside if "unknown" in named or named >= before else one.found

    def _select(self, problem: RegressionProblem, train: Index, held_out: Index) -> _Selection:
        """Select named terms, again without those that do not predict what is left out."""
        validation = CrossValidation(problem.equations, train)
        withdrawn: list[WithdrawnEffect] = []
        for _ in range(MOST_SEARCHES):
            chosen = select(validation, self.rules, {one.effect for one in withdrawn})
            refined, terms = refine(problem, chosen, train)
            terms, more = self._admissible_and_predictive(refined, terms, train)
            withdrawn += more
            if not more:
                break
        kept = {c.effect for c in terms}
        chosen = [c for c in chosen if c.effect in kept]
        rivals = {name: compare_rivals(validation, chosen, name) for name in effect_names(chosen)}
        return _Selection(
            FoundTerms(
                inputs=self._inputs,
                problem=refined,
                terms=terms,
                train=train,
                held_out=held_out,
                rivals=rivals,
                withdrawn=withdrawn,
            ),
            chosen,
        )

    def _select_beside(self, unnamed: Sequence[TermKey], before: _Selection) -> FoundTerms:
        """Select named terms once more beside the `unnamed` ones."""
        train = before.found.train
        wide = extended(self.problem, unnamed)
        validation = CrossValidation(wide.equations, train)
        own = wide.equations.by_key
        previous, beside = [own[c.key] for c in before.chosen], [own[key] for key in unnamed]
        excluded = {one.effect for one in before.found.withdrawn}
        chosen = select_beside_unnamed(validation, self.rules, previous, beside, excluded)
        rivals = {name: compare_rivals(validation, chosen, name) for name in effect_names(chosen)}
        del validation  # free its memory before the refinement
        refined, terms = refine(wide, chosen, train)
        terms, more = self._admissible_and_predictive(refined, terms, train)
        withdrawn = [*before.found.withdrawn, *more]
        return before.found._replace(problem=refined, terms=terms, rivals=rivals, withdrawn=withdrawn)

    def _admissible_and_predictive(
        self, refined: RegressionProblem, terms: list[CandidateTerm], train: Index
    ) -> tuple[list[CandidateTerm], list[WithdrawnEffect]]:
        """The terms that are physically possible and predict what is left out; the others with the reason."""
        withdrawn: list[WithdrawnEffect] = []
        while True:
            equations = refined.equations
            slots = equations.slots(terms)
            weights = equations.denormalised(slots, equations.solve(slots, equations.totals(train)))
            impossible = vetoed(refined, terms, weights, self.axis)
            impossible = impossible or self._absorbing_mass(refined, terms, train)
            if not impossible:
                break
            withdrawn += [WithdrawnEffect(effect, why) for effect, why in impossible.items()]
            terms = [c for c in terms if c.effect not in impossible]
        terms, more = predictive_terms(equations, terms, train)
        return terms, [*withdrawn, *more]

    def _absorbing_mass(
        self, refined: RegressionProblem, terms: Sequence[CandidateTerm], train: Index
    ) -> dict[str, str]:
        """The effect that has absorbed nearly all of the fitted mass, if there is one, with the reason."""
        if self.channel is not ResidualChannel.FORCE:
            return {}
        totals = refined.equations.totals(train)

        def mass_kg(chosen: Sequence[CandidateTerm]) -> float:
            return moved_kg(refined, chosen, totals)

        # a weight on a joint dominates its torque, and falsifies the mass of a model without it
        weights = [c for c in terms if c.effect == GRAVITY]
        named = [e for e in effect_names(terms) if not e.startswith(PREFIX) and e != GRAVITY]
        rigid_kg = mass_kg(weights)
        if weights and rigid_kg < LEAST_NOMINAL_SHARE * self.axis.mass_kg:
            named, rigid_kg = [GRAVITY], mass_kg([])
        least_kg = max(LEAST_MASS_SHARE * rigid_kg, LEAST_NOMINAL_SHARE * self.axis.mass_kg)
        # a motion without observable mass, as at constant speed, cannot reject it
        if not named or rigid_kg <= 0.0 or mass_kg(terms) >= least_kg:
            return {}
        others_kg = {effect: mass_kg([c for c in terms if c.effect != effect]) for effect in named}
        worst = max(others_kg, key=lambda effect: others_kg[effect])
        why = f"beside it the mass would be {mass_kg(terms):.3g} kg, {rigid_kg:.3g} kg without any effect"
        return {worst: why}

    def _is_noise(self, found: FoundTerms) -> bool:
        """Whether the residual is no more than the noise of the sensors."""
        equations = found.problem.equations
        theta = equations.solve(equations.slots(found.terms), equations.totals(found.train))
        found_residuals = residuals(found.problem, self.sources, [(found.terms, theta)] * 3, found.held_out)
        floor = noise_floor(found_residuals, self.channel, self.axis.mass_kg).rms
        return rms(found_residuals, "after") <= NOISE_FLOOR_RATIO * floor


def _name(candidate: CandidateTerm) -> str:
    return "unknown" if candidate.effect.startswith(PREFIX) else candidate.effect
