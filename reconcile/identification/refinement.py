"""Refinement of the selected terms: shape parameters on finer grids, with the force of the whole model.

Selection scans coarse grids with the force of a rigid model. The selected terms give a better force, and so a
better friction of the sticking axis; with it each term's shape parameters are refined beside all the others.
"""

from collections.abc import Sequence

from kernels.arrays import Index
from reconcile.catalogue.kinds import RegressionData, ResidualChannel, ShapeParameters
from reconcile.catalogue.registry import ENTRIES, family, possible
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.catalogue.unnamed_terms import SHARP, term
from reconcile.identification.model_force import with_identified_force
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.regression_problem import RegressionProblem, regression_problem
from reconcile.selection.cross_validation import CrossValidation

GRID_RATIOS = (1.2, 1.07, 1.02)
"""Ratios of neighbouring grid points in the successive rounds; the scan's own grid comes first."""
NEIGHBOURS = 2
"""Grid points tried to either side in a round."""
SWEEPS = 2
"""Coordinate searches over all terms in a round."""
TIED_SQUARES_SHARE = 1e-3
"""Largest relative difference of squares between shape parameters that are tied."""
LEAST_SHAPE_GAIN = 0.05
"""Least relative gain, cross-validated, of a second term of the same effect."""
CONTINUOUS = {
    **{name: entry.continuous_shape_parameters for name, entry in ENTRIES.items()},
    **{PREFIX + name: 1 for name in SHARP},
}
"""By effect: the number of leading shape parameters that are continuous."""


def refine(
    scanned_problem: RegressionProblem, chosen: list[CandidateTerm], train: Index
) -> tuple[RegressionProblem, list[CandidateTerm]]:
    """A regression problem of the chosen terms alone, each at its best shape parameters beside the others.

    Repeated terms of an effect that gain too little are dropped.
    """
    best = _refine_shapes(scanned_problem, chosen, train)
    while True:
        fewer = _without_weakest(best, train)
        if not fewer:
            return best
        simpler = _refine_shapes(scanned_problem, fewer, train)
        if _all_possible(best, train) and _validated_squares(simpler, train) > (
            1.0 + LEAST_SHAPE_GAIN
        ) * _validated_squares(best, train):
            return best
        best = simpler


def datasets_with_force(
    problem: RegressionProblem, chosen: list[CandidateTerm], train: Index
) -> Sequence[RegressionData]:
    """The datasets with the force of the model of these terms; unchanged in the deviation."""
    if problem.channel is not ResidualChannel.FORCE:
        return problem.datasets
    equations = problem.equations
    slots = equations.slots(chosen)
    weights = equations.denormalised(slots, equations.solve(slots, equations.totals(train)))
    return [
        with_identified_force(problem, recording, slots, weights) for recording in range(equations.recordings)
    ]


def _refine_shapes(
    scanned_problem: RegressionProblem, chosen: list[CandidateTerm], train: Index
) -> tuple[RegressionProblem, list[CandidateTerm]]:
    """Search the scan's grid again, because the force and the other terms changed; then finer grids."""
    alone = [(c, [c.shape_parameters]) for c in chosen]
    problem, best = _best_shapes(scanned_problem, scanned_problem.datasets, alone, train)
    for step in (0.0, *GRID_RATIOS):
        datasets = datasets_with_force(problem, best, train)
        options = [(c, _shape_options(datasets, scanned_problem.channel, c, step)) for c in best]
        problem, best = _best_shapes(scanned_problem, datasets, options, train)
    return problem, best


def _best_shapes(
    scanned_problem: RegressionProblem,
    datasets: Sequence[RegressionData],
    options_of: list[tuple[CandidateTerm, list[ShapeParameters]]],
    train: Index,
) -> tuple[RegressionProblem, list[CandidateTerm]]:
    """Best of each term's options, by coordinate search."""
    all_shapes = [(c.effect, shape) for c, options in options_of for shape in options]
    problem = regression_problem(
        datasets, scanned_problem.channel, all_shapes, only=True, model_terms=scanned_problem.model_terms
    )
    validation = CrossValidation(problem.equations, train)
    by_key = problem.equations.by_key
    best = [by_key[c.key] for c, _ in options_of]
    for _ in range(SWEEPS):
        for place, (c, shapes) in enumerate(options_of):
            options = [by_key[c.effect, shape, c.per_recording] for shape in shapes]
            others = [*best[:place], *best[place + 1 :]]
            open_options = [option for option in options if option not in others]
            if len(open_options) > 1:
                best[place] = _middle_of_ties(
                    [(o, validation.total_squares([*others, o])) for o in open_options]
                )
    return problem, best


def _middle_of_ties(squares_of: Sequence[tuple[CandidateTerm, float]]) -> CandidateTerm:
    """Middle one of the tied best options: while nothing moves, all times of an event are equal."""
    least = min(squares for _, squares in squares_of)
    alike = sorted(
        (o for o, squares in squares_of if squares <= (1.0 + TIED_SQUARES_SHARE) * least),
        key=lambda o: o.shape_parameters,
    )
    return alike[len(alike) // 2] if len(alike) > 2 else min(squares_of, key=lambda pair: pair[1])[0]


def _shape_options(
    datasets: Sequence[RegressionData], channel: ResidualChannel, c: CandidateTerm, step: float
) -> list[ShapeParameters]:
    """Neighbours at the ratio `step`; the scan's grid where that is 0."""
    if not CONTINUOUS.get(c.effect):
        return [c.shape_parameters]
    if step:
        numbers = range(CONTINUOUS[c.effect])
        factors = [step**k for k in range(-NEIGHBOURS, NEIGHBOURS + 1)]
        return [
            *dict.fromkeys(
                [c.shape_parameters, *(_scaled(c.shape_parameters, at, k) for at in numbers for k in factors)]
            )
        ]
    scanned = term(c.effect) if c.effect.startswith(PREFIX) else family(c.effect, channel)
    return [*dict.fromkeys([c.shape_parameters, *(scanned.shapes(datasets) if scanned else [])])]


def _scaled(shape: ShapeParameters, at: int, factor: float) -> ShapeParameters:
    return (*shape[:at], factor * shape[at], *shape[at + 1 :])


def _validated_squares(model: tuple[RegressionProblem, list[CandidateTerm]], train: Index) -> float:
    problem, chosen = model
    return CrossValidation(problem.equations, train).total_squares(chosen)


def _all_possible(model: tuple[RegressionProblem, list[CandidateTerm]], train: Index) -> bool:
    """Whether repeated terms of one effect are each physically possible beside the others."""
    problem, chosen = model
    validation = CrossValidation(problem.equations, train)
    return all(
        possible(c.effect, validation.coefficients([*(o for o in chosen if o != c), c])[-len(c.columns) :])
        for c in chosen
        if sum(o.effect == c.effect for o in chosen) > 1 and not c.per_recording
    )


def _without_weakest(
    model: tuple[RegressionProblem, list[CandidateTerm]], train: Index
) -> list[CandidateTerm]:
    """The terms without the weakest repeated term of an effect; empty if no effect is repeated."""
    problem, chosen = model
    refinable = [c for c in chosen if CONTINUOUS.get(c.effect)]
    repeated = [c for c in refinable if sum(o.effect == c.effect for o in chosen) > 1]
    if not repeated:
        return []
    validation = CrossValidation(problem.equations, train)
    fewer = [[one for one in chosen if one != c] for c in repeated]
    return min(fewer, key=validation.total_squares)
