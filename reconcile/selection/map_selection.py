"""Selection of the map: an unnamed force over position and velocity together, beside the selected terms.

It has the columns of dozens of curves, so it is tried last, in what the other terms leave, and stays only
where it predicts folds and left-out recordings better than the curves over one coordinate do.
"""

from collections.abc import Sequence

from kernels.arrays import Index
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.map_term import MAP, MAP_TERM, column_scales
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.regression.candidate_term import CandidateTerm, TermKey
from reconcile.regression.regression_problem import RegressionProblem, regression_problem
from reconcile.selection.cross_validation import CrossValidation
from reconcile.selection.predictive_terms import held_out_parts, held_out_squares_by_block
from reconcile.selection.selection_rules import SelectionRules
from reconcile.selection.unnamed_screening import predicted_shares

MAP_EFFECT = PREFIX + MAP
FEWEST_RECORDINGS = 2
"""A motion that repeats within one recording shows the same places at the same speeds again, so that no part
of it tests a map."""
CARRIED = frozenset(
    PREFIX + name
    for name in (
        "position",
        "velocity",
        "position_by_direction",
        "position_of_the_damping",
        "speed_by_direction",
    )
)
"""Curves that a map may carry: they are omitted beside it where it predicts no worse without them."""


def select_map(
    problem: RegressionProblem, chosen: Sequence[CandidateTerm], train: Index, rules: SelectionRules
) -> list[TermKey]:
    """Return the unnamed terms with the map: beside those `chosen`, or in place of some; none without it."""
    if problem.channel is not ResidualChannel.FORCE or len(problem.datasets) < FEWEST_RECORDINGS:
        return []
    shapes = MAP_TERM.shapes(problem.datasets)
    if not shapes:
        return []
    undamped = MAP_EFFECT, shapes[0]
    shares = predicted_shares(problem, chosen, train, undamped, [column_scales(one) for one in shapes])
    if max(shares) < rules.least_unnamed_gain:
        return []
    best = shapes[shares.index(max(shares))]
    wide = regression_problem(
        problem.datasets,
        problem.channel,
        [*((c.effect, c.shape_parameters) for c in chosen), (MAP_EFFECT, best)],
        only=True,
        model_terms=problem.model_terms,
    )
    own = wide.equations.by_key
    terms, surface = [own[c.key] for c in chosen], own[MAP_EFFECT, best, False]
    without_carried = [c for c in terms if c.effect not in CARRIED]
    parts = held_out_parts(wide.equations, train)

    def left_out_squares(model: Sequence[CandidateTerm]) -> float:
        return float(held_out_squares_by_block(wide.equations, model, parts).sum())

    others = min((without_carried, terms), key=lambda kept: left_out_squares([*kept, surface]))
    validation = CrossValidation(wide.equations, train)
    squares = validation.cross_validated_squares(terms)
    score = validation.score_last([*others, surface], squares)
    is_better = (
        score.gain >= rules.least_unnamed_gain
        and score.is_significant(len(shapes), rules.false_alarm)
        and left_out_squares([*others, surface]) <= (1.0 - rules.least_unnamed_gain) * left_out_squares(terms)
    )
    kept = [c.key for c in others if c.effect.startswith(PREFIX)]
    return [*kept, surface.key] if is_better else []
