"""Selection of unnamed terms, which explain what no effect of the catalogue does."""

from collections.abc import Sequence

from kernels.arrays import Index
from reconcile.catalogue.drive_compliance import ENTRY as DRIVE_COMPLIANCE
from reconcile.catalogue.relaxation_terms import RINGING_EFFECT
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.catalogue.unnamed_terms import other_shapes
from reconcile.regression.candidate_term import CandidateTerm, TermKey
from reconcile.regression.regression_problem import RegressionProblem, regression_problem
from reconcile.selection.cross_validation import CrossValidation, SelectionRules
from reconcile.selection.stepwise_selection import TIED_GAIN_RATIO, initial_squares
from reconcile.selection.unnamed_screening import promising_curves, promising_moments

SAME_MODE_RATIO = 1.3
"""Ratio of frequencies within which an unnamed ringing is that of a named spring; chosen: its resonator
covers a tenth to either side, as the flank of the spring does."""


def select_unnamed(
    final: RegressionProblem, chosen: Sequence[CandidateTerm], train: Index, rules: SelectionRules
) -> list[TermKey]:
    """Select at most `rules.most_unknown` unnamed terms beside the `chosen` ones."""
    tried = [
        *((c.effect, c.shape_parameters) for c in chosen),
        *promising_curves(final, chosen, train),
        *promising_moments(final, chosen, train),
        *other_shapes(final.datasets, final.channel),
    ]
    problem = regression_problem(
        final.datasets, final.channel, tried, only=True, model_terms=final.model_terms
    )
    validation = CrossValidation(problem.equations, train)
    unnamed = [
        c
        for c in problem.equations.candidates
        if c.effect.startswith(PREFIX) and not any(is_of_spring(c, spring) for spring in chosen)
    ]
    named_terms = [problem.equations.by_key[c.key] for c in chosen]
    initial = initial_squares(validation, named_terms)
    selected: list[CandidateTerm] = []
    while len(selected) < rules.most_unknown:
        before = validation.cross_validated_squares([*named_terms, *selected])
        least_gain = max(
            rules.least_unknown, rules.least_unknown_share * initial / max(float(before.sum()), 1e-300)
        )
        scores = [
            validation.score([*named_terms, *selected], before, c)
            for c in unnamed
            if c.effect not in {other.effect for other in selected}
            and validation.gain([*named_terms, *selected, c], before) >= least_gain
        ]
        accepted = [score for score in scores if score.beyond_chance(len(unnamed), rules.false_alarm)]
        if not accepted:
            break
        least = TIED_GAIN_RATIO * max(score.gain for score in accepted)
        tied = [score.candidate for score in accepted if score.gain >= least]
        selected.append(min(tied, key=problem.equations.coefficients))
    return [c.key for c in selected]


def is_of_spring(unnamed: CandidateTerm, named: CandidateTerm) -> bool:
    """Whether an unnamed ringing is at the antiresonance of a spring that is named from the motor alone.

    The two would share one load, and no plant is their sum.
    """
    if (
        unnamed.effect != RINGING_EFFECT
        or named.effect != DRIVE_COMPLIANCE.name
        or not named.shape_parameters
    ):
        return False
    ratio = unnamed.shape_parameters[0] / named.shape_parameters[0]
    return 1.0 / SAME_MODE_RATIO < ratio < SAME_MODE_RATIO
