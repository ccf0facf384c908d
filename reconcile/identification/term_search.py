"""The search for terms in one residual channel of one axis, on all recordings or without one of them.

The columns of all candidates are computed once. A search on fewer recordings uses only their blocks of these
columns, so that names, shapes and coefficients come from these recordings alone.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Index
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.map_term import MAP_COLUMNS
from reconcile.catalogue.smooth_terms import KNOTS
from reconcile.errors import ReconcileError
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.identification.absorbed_mass import absorbing_mass
from reconcile.identification.coupled_joint import SOUGHT_TOGETHER, beside_coupled_joint
from reconcile.identification.held_out_blocks import training_and_held_out
from reconcile.identification.refinement import refine
from reconcile.identification.rivals import compare_rivals
from reconcile.identification.selected_terms import SearchInputs, SelectedTerms
from reconcile.identification.spring_beside_terms import spring_beside, spring_of, with_spring_refitted
from reconcile.recording.recording import AxisRecording
from reconcile.regression.candidate_term import CandidateTerm, TermKey, effect_names
from reconcile.regression.model_presliding import regressed_terms
from reconcile.regression.physical_veto import vetoed
from reconcile.regression.regression_data import regression_data
from reconcile.regression.regression_problem import RegressionProblem, extended, regression_problem
from reconcile.regression.residual import residuals, rms
from reconcile.regression.residual_noise import noise_floor
from reconcile.selection.cross_validation import CrossValidation
from reconcile.selection.map_selection import MAP_EFFECT, select_map
from reconcile.selection.predictive_terms import WithdrawnEffect, predictive_terms
from reconcile.selection.selection_rules import SelectionRules
from reconcile.selection.stepwise_selection import select, select_beside_unnamed
from reconcile.selection.unnamed_selection import select_unnamed

NOISE_FLOOR_RATIO = 1.5
"""Residual RMS over the noise floor up to which no unnamed terms are tried."""
MOST_SEARCHES = 3
"""Searches, each without the effects that were withdrawn after the one before. Chosen."""


class _Scan(NamedTuple):
    """What a search begins with: all candidate terms, and among them those of a joint that moves this one."""

    problem: RegressionProblem
    joint: list[TermKey]
    train: Index
    held_out: Index


class _Selection(NamedTuple):
    scan: _Scan
    refined: SelectedTerms
    scanned: list[CandidateTerm]
    """The same terms in the problem of all candidates, at the shape parameters of the scan."""
    spring: TermKey | None
    """Among them, a spring that the scan has not found."""
    given: list[TermKey]
    """Among them, those that were not sought one by one: the spring, and a joint that moves this one."""


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
        self._sampling_s = datasets[0].period_s
        model_terms = regressed_terms(axis, datasets, channel)
        self._spare = rules.most_unnamed_terms * max(KNOTS) + MAP_COLUMNS + 1
        self.problem = regression_problem(
            [data._replace(spring=spring_of(model_terms)) for data in datasets],
            channel,
            model_terms=model_terms,
            spare=self._spare,
        )
        self._train, self._held_out = training_and_held_out(self.problem)
        if not len(self._train):
            reason = "in no half second does the motion stand out from noise or oscillation"
            remedy = "record larger or faster motions, and softer gains if the axis oscillates"
            raise ReconcileError(", ".join(self.sources), f"axis {recordings[0].axis}", reason, remedy)

    def release(self) -> None:
        """Release the memory of the columns; only the blocks of samples are still known."""
        self.problem.equations.release()

    def select_terms(self, left_out: Index | None = None) -> SelectedTerms:
        """Select and refine the terms, without any use of the blocks that are left out."""
        train, held_out = (
            blocks if left_out is None else blocks[~np.isin(blocks, left_out)]
            for blocks in (self._train, self._held_out)
        )
        if self.channel is not ResidualChannel.FORCE:
            return self._select(_Scan(self.problem, [], train, held_out))
        problem, joint = beside_coupled_joint(self.problem, train, self._spare)
        return self._select(_Scan(problem, joint, train, held_out))

    def _select(self, scan: _Scan, spring: TermKey | None = None) -> SelectedTerms:
        """Select named terms, then unnamed ones; again beside a spring in what either leaves, if any."""
        named = self._select_named(scan, spring)
        first = named.refined
        if self._is_noise(first):
            return first
        if spring is None and (found := self._spring_beside(first)):
            return self._select(scan, found)
        unnamed = select_unnamed(first.problem, first.terms, scan.train, self.rules)
        if not unnamed:
            return self._with_map(first, named)
        second = self._select_beside(unnamed, named)
        before, after = _names(first), _names(second)
        # the second fit is kept only if no reported name is lost, or an unnamed term was accepted
        if "unknown" not in after and not after >= before:
            return self._with_map(first, named)
        if spring is None and (found := self._spring_beside(second)):
            return self._select(scan, found)
        return self._with_map(second, named)

    def _with_map(self, before: SelectedTerms, named: _Selection) -> SelectedTerms:
        """The terms with the map over two coordinates, if it is accepted and changes no name."""
        unnamed = select_map(before.problem, before.terms, before.train, self.rules)
        if not unnamed:
            return before
        mapped = self._select_beside(unnamed, named)
        is_kept = any(c.effect == MAP_EFFECT for c in mapped.terms)
        return mapped if is_kept and _names(mapped) - {"unknown"} == _names(before) - {"unknown"} else before

    def _spring_beside(self, selected: SelectedTerms) -> TermKey | None:
        """A load on a spring in what the selected terms leave of the force, unless one is known already."""
        known = spring_of(selected.terms) or self.problem.datasets[0].spring
        if known or self.channel is not ResidualChannel.FORCE:
            return None
        return spring_beside(selected.problem, selected.terms, selected.train)

    def _select_named(self, scan: _Scan, spring: TermKey | None = None) -> _Selection:
        """Select named terms beside a `spring`, again without those that do not predict held-out folds."""
        springs, train = [spring] if spring else [], scan.train
        problem = extended(scan.problem, springs)
        validation = CrossValidation(problem.equations, train)
        given = [problem.equations.by_key[key] for key in (*scan.joint, *springs)]
        withdrawn: list[WithdrawnEffect] = []
        for _ in range(MOST_SEARCHES):
            excluded = SOUGHT_TOGETHER | {one.effect for one in withdrawn}
            chosen = select(validation, self.rules, excluded, given, self._sampling_s)
            refined, terms = with_spring_refitted(*refine(problem, chosen, train), train, spring)
            terms, more = self._admissible_and_predictive(refined, terms, train)
            withdrawn += more
            given = [c for c in given if any(c.effect == other.effect for other in terms)]
            if not more:
                break
        kept = {c.effect for c in terms}
        chosen = [c for c in chosen if c.effect in kept]
        rivals = {name: compare_rivals(validation, chosen, name) for name in effect_names(chosen)}
        return _Selection(
            scan=scan,
            refined=SelectedTerms(
                inputs=self._inputs,
                problem=refined,
                terms=terms,
                train=train,
                held_out=scan.held_out,
                rivals=rivals,
                withdrawn=withdrawn,
            ),
            scanned=chosen,
            spring=spring if any(c.key == spring for c in given) else None,
            given=[c.key for c in given],
        )

    def _select_beside(self, unnamed: Sequence[TermKey], before: _Selection) -> SelectedTerms:
        """Select named terms once more beside the `unnamed` ones."""
        train = before.scan.train
        wide = extended(before.scan.problem, [*([before.spring] if before.spring else []), *unnamed])
        validation = CrossValidation(wide.equations, train)
        own = wide.equations.by_key
        previous, beside = [own[c.key] for c in before.scanned], [own[key] for key in unnamed]
        excluded = SOUGHT_TOGETHER | {one.effect for one in before.refined.withdrawn}
        given = [own[key] for key in before.given]
        chosen = select_beside_unnamed(
            validation, self.rules, previous, beside, excluded, given, self._sampling_s
        )
        rivals = {name: compare_rivals(validation, chosen, name) for name in effect_names(chosen)}
        del validation  # free its memory before the refinement
        refined, terms = with_spring_refitted(*refine(wide, chosen, train), train, before.spring)
        terms, more = self._admissible_and_predictive(refined, terms, train)
        if before.spring and not spring_of(terms):
            return before.refined
        withdrawn = [*before.refined.withdrawn, *more]
        return before.refined._replace(problem=refined, terms=terms, rivals=rivals, withdrawn=withdrawn)

    def _admissible_and_predictive(
        self, refined: RegressionProblem, terms: list[CandidateTerm], train: Index
    ) -> tuple[list[CandidateTerm], list[WithdrawnEffect]]:
        """Return the possible terms that predict held-out folds, and the withdrawn effects."""
        withdrawn: list[WithdrawnEffect] = []
        while True:
            equations = refined.equations
            slots = equations.slots(terms)
            weights = equations.denormalised(slots, equations.solve(slots, equations.totals(train)))
            impossible = vetoed(refined, terms, weights, self.axis)
            if not impossible and self.channel is ResidualChannel.FORCE:
                impossible = absorbing_mass(refined, terms, train, self.axis.mass_kg)
            if not impossible:
                break
            withdrawn += [WithdrawnEffect(effect, why) for effect, why in impossible.items()]
            terms = [c for c in terms if c.effect not in impossible]
        terms, more = predictive_terms(equations, terms, train)
        return terms, [*withdrawn, *more]

    def _is_noise(self, selected: SelectedTerms) -> bool:
        """Return whether the residual is no more than the noise of the sensors."""
        equations = selected.problem.equations
        theta = equations.solve(equations.slots(selected.terms), equations.totals(selected.train))
        models = [(selected.terms, theta)] * 3
        after = residuals(selected.problem, self.sources, models, selected.held_out)
        floor = noise_floor(after, self.channel, self.axis.mass_kg).rms
        return rms(after, "after") <= NOISE_FLOOR_RATIO * floor


def _names(selected: SelectedTerms) -> set[str]:
    """The names that a report of the terms has; `unknown` stands for unnamed ones."""
    return {finding.effect for finding in selected.report(resamples=0).findings}
