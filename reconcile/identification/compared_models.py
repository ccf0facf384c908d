"""The three models of a channel that are compared: nominal values, refitted values, and the effects."""

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.kinds import ResidualChannel, ShapeParameters
from reconcile.formats.nominal_axis import NominalAxis, baseline_parameters
from reconcile.identification.term_search import FoundTerms
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.regression_problem import RegressionProblem


def compared_models(
    found: FoundTerms, admissible: FoundTerms, timing: tuple[str, ShapeParameters] | None
) -> list[tuple[list[CandidateTerm], Array]]:
    """Return terms and normalised coefficients of the nominal, the refitted and the identified model.

    A lag below a sample is how the channels were sampled, and no physics: all three have it. `admissible`:
    the found terms beside a baseline without negative values, which the identified model has.
    """
    equations = found.problem.equations
    timing_terms = [c for c in found.terms if timing and c.effect == timing[0]]
    totals = equations.totals(found.train)
    refitted = equations.solve(equations.slots(timing_terms), totals)
    nominal = nominal_coefficients(found.inputs.axis, found.problem, refitted)
    identified = admissible.problem.equations.solve(equations.slots(found.terms), totals)
    return [(timing_terms, nominal), (timing_terms, refitted), (found.terms, identified)]


def nominal_coefficients(axis: NominalAxis, problem: RegressionProblem, refitted: Array) -> Array:
    """Return the normalised coefficients (k,) of the nominal model.

    `refitted` (k,): those of the refitted one. Origins and timing are taken from it, for no model file has
    them.
    """
    equations = problem.equations
    baseline = equations.slots([])
    size = len(baseline)
    if problem.channel is ResidualChannel.FORCE:
        of_axis = baseline_parameters(axis)
        nominal = np.array([of_axis[name] for name in problem.baseline_names])
    else:
        is_origin = [problem.baseline_names[column] == "origin_m" for column, _ in baseline]
        nominal = np.where(is_origin, equations.denormalised(baseline, refitted[:size]), 0.0)
    return np.append(nominal / equations.denormalised(baseline, np.ones(size)), refitted[size:])
