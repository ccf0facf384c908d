"""The terms that a search has selected in a channel, with what their fit needs."""

from collections.abc import Container
from typing import NamedTuple

from kernels.arrays import Index
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.identification.findings import ReportedEffects, report_findings
from reconcile.identification.parameter_estimates import RESAMPLES
from reconcile.identification.rivals import RivalEffect
from reconcile.identification.spring_beside_terms import passed_on_by_spring
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.regression_problem import RegressionProblem
from reconcile.selection.predictive_terms import WithdrawnEffect
from reconcile.selection.selection_rules import SelectionRules


class SearchInputs(NamedTuple):
    """The axis, channel and recordings of a search, and the rules of selection."""

    axis: NominalAxis
    channel: ResidualChannel
    rules: SelectionRules
    sources: list[str]
    """By recording."""


class SelectedTerms(NamedTuple):
    """The selected terms of a channel, and the data of their fit."""

    inputs: SearchInputs
    problem: RegressionProblem
    """With these terms alone, at their refined shape parameters."""
    terms: list[CandidateTerm]
    train: Index
    held_out: Index
    rivals: dict[str, tuple[float, list[RivalEffect]]]
    withdrawn: list[WithdrawnEffect]

    def without(self, effects: Container[str]) -> "SelectedTerms":
        """Return the terms without some effects; `unknown` stands for all unnamed terms."""
        kept = [c for c in self.terms if _name(c) not in effects and c.effect not in effects]
        rivals = {effect: of for effect, of in self.rivals.items() if any(c.effect == effect for c in kept)}
        problem, kept = passed_on_by_spring(self.problem, kept)
        return self._replace(problem=problem, terms=kept, rivals=rivals)

    def report(self, resamples: int = RESAMPLES) -> ReportedEffects:
        """Return parameters, rivals and confidence of each effect; with 0 `resamples`, no intervals."""
        return report_findings(
            problem=self.problem,
            chosen=self.terms,
            rivals=self.rivals,
            train=self.train,
            held_out_blocks=self.held_out,
            resamples=resamples,
        )


def _name(candidate: CandidateTerm) -> str:
    return "unknown" if candidate.effect.startswith(PREFIX) else candidate.effect
