"""Selection of unnamed terms, which explain what no effect of the catalogue does."""

from collections.abc import Sequence

from kernels.arrays import Index
from reconcile.catalogue.drive_compliance import ENTRY as DRIVE_COMPLIANCE
from reconcile.catalogue.relaxation_terms import RINGING_EFFECT
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.catalogue.unnamed_terms import other_shapes
from reconcile.regression.candidate_term import CandidateTerm, TermKey
from reconcile.regression.regression_problem import RegressionProblem, regression_problem
from reconcile.selection.cross_validation import CrossValidation
from reconcile.selection.selection_rules import SelectionRules
from reconcile.selection.shortlist import TIED_GAIN_RATIO
from reconcile.selection.stepwise_selection import initial_squares
from reconcile.selection.unnamed_screening import promising_curves, promising_moments

SAME_MODE_RATIO = 1.3
"""Ratio of frequencies within which an unnamed ringing is that of a named spring; chosen: its resonator
covers a tenth to either side, as the flank of the spring does."""


def select_unnamed(
    named: RegressionProblem, chosen: Sequence[CandidateTerm], train: Index, rules: SelectionRules
) -> list[TermKey]:
    """Select at most `rules.most_unnamed_terms` beside the `chosen` terms of the problem `named`."""
    shapes = [
        *((c.effect, c.shape_parameters) for c in chosen),
        *promising_curves(named, chosen, train),
        *promising_moments(named, chosen, train),
        *other_shapes(named.datasets, named.channel),
    ]
    problem = regression_problem(
        named.datasets, named.channel, shapes, only=True, model_terms=named.model_terms
    )
    validation = CrossValidation(problem.equations, train)
    unnamed = [
        c
        for c in problem.equations.candidates
        if c.effect.startswith(PREFIX) and not any(is_of_spring(c, spring) for spring in chosen)
    ]
    named_terms = [problem.equations.by_key[c.key] for c in chosen]
    least_removed = rules.least_unnamed_initial_share * initial_squares(validation, named_terms)
    selected: list[CandidateTerm] = []
    while len(selected) < rules.most_unnamed_terms:
        squares_without = validation.cross_validated_squares([*named_terms, *selected])
        least_gain = max(rules.least_unnamed_gain, least_removed / max(float(squares_without.sum()), 1e-300))
        scores = [
            validation.score([*named_terms, *selected], squares_without, c)
            for c in unnamed
            if c.effect not in {other.effect for other in selected}
            and validation.gain([*named_terms, *selected, c], squares_without) >= least_gain
        ]
        significant = [score for score in scores if score.is_significant(len(unnamed), rules.false_alarm)]
        if not significant:
            break
        least_tied_gain = TIED_GAIN_RATIO * max(score.gain for score in significant)
        tied = [score.candidate for score in significant if score.gain >= least_tied_gain]
        selected.append(min(tied, key=problem.equations.coefficients))
    return [c.key for c in selected]


def is_of_spring(unnamed: CandidateTerm, named: CandidateTerm) -> bool:
    """Whether an unnamed ringing is at the antiresonance of a spring that is named from the motor alone.

    Both would be the same load on the same spring, so a plant cannot have them beside each other.
    """
    if (
        unnamed.effect != RINGING_EFFECT
        or named.effect != DRIVE_COMPLIANCE.name
        or not named.shape_parameters
    ):
        return False
    ratio = unnamed.shape_parameters[0] / named.shape_parameters[0]
    return 1.0 / SAME_MODE_RATIO < ratio < SAME_MODE_RATIO
