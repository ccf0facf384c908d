"""The joint of a robot that moves this one, before any other effect is sought.

Coupled joints push each other with forces that are as large as their own: the coupling and the weight of the
outer link balance each other where a link swings. Neither explains much alone, so a search by one term after
the other takes effects that resemble their sum. They are sought together.
"""

from collections.abc import Iterator, Sequence

from kernels.arrays import Index
from reconcile.catalogue.gravity import ENTRY as GRAVITY
from reconcile.catalogue.gravity_of_outer_link import ENTRY as WEIGHT
from reconcile.catalogue.joint_coupling import ENTRY as COUPLING
from reconcile.identification.refinement import datasets_with_force
from reconcile.regression.candidate_term import CandidateTerm, TermKey
from reconcile.regression.regression_problem import RegressionProblem, regression_problem
from reconcile.selection.cross_validation import CrossValidation

SOUGHT_TOGETHER = frozenset({COUPLING.name, WEIGHT.name})
"""Effects that no search by one term after the other may take."""
MOST_LEFT, MOST_LEFT_OF_ONE = 0.5, 0.25
"""Largest share of the held-out squares that such a model leaves of those of a joint by itself, and with one
recording, in which all joints may have moved in a fixed relation. Chosen on measured robots: two parallel
joints left 0.05 to 0.43 in any four recordings and more, wrong models of them 0.75 to 0.93; one recording of
other robots 0.3 to 0.8."""


def beside_coupled_joint(
    problem: RegressionProblem, train: Index, spare: int
) -> tuple[RegressionProblem, list[TermKey]]:
    """The problem scanned anew with the force of a joint that moves this one, and the terms of that joint.

    Some candidates are read off what a model leaves of the force: lines of its spectrum, places of a bump. No
    coupling may be in it. Without such a joint the problem as it is, and no terms.
    """
    joint = _coupled_joint(CrossValidation(problem.equations, train))
    if not joint:
        return problem, []
    scanned = regression_problem(
        datasets_with_force(problem, joint, train),
        problem.channel,
        [(c.effect, c.shape_parameters) for c in joint],
        model_terms=problem.model_terms,
        spare=spare,
    )
    return scanned, [c.key for c in joint]


def _coupled_joint(validation: CrossValidation) -> list[CandidateTerm]:
    """Return the terms of the joint that predicts the force best on held-out folds; empty without one."""
    candidates = validation.equations.candidates
    own = [c for c in candidates if c.effect == GRAVITY.name and not c.per_recording][:1]

    def squares(terms: Sequence[CandidateTerm]) -> float:
        return float(validation.cross_validated_squares(terms).sum())

    found = [(squares(terms), terms) for terms in _models(candidates, own)]
    if not found:
        return []
    left, best = min(found, key=lambda one: one[0])
    alone = min(squares([]), squares(own))
    most_left = MOST_LEFT if validation.equations.recordings > 1 else MOST_LEFT_OF_ONE
    return best if left <= most_left * alone else []


def _models(
    candidates: Sequence[CandidateTerm], own: Sequence[CandidateTerm]
) -> Iterator[list[CandidateTerm]]:
    """Coupling with one joint, with and without the weight of the outer link and the joint's own."""
    for coupling in (c for c in candidates if c.effect == COUPLING.name):
        joint = coupling.shape_parameters[0]
        weights = [c for c in candidates if c.effect == WEIGHT.name and c.shape_parameters[0] == joint]
        for weight in ([], *([w] for w in weights)):
            yield [coupling, *weight]
            if own:
                yield [coupling, *weight, *own]
