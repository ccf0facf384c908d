"""The three models of a channel that are compared: nominal values, refitted values, and the effects."""

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.kinds import ResidualChannel, ShapeParameters
from reconcile.formats.nominal_axis import NominalAxis, baseline_parameters
from reconcile.identification.selected_terms import SelectedTerms
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.regression_problem import RegressionProblem


def compared_models(
    selected: SelectedTerms, admissible: SelectedTerms, timing: tuple[str, ShapeParameters] | None
) -> list[tuple[list[CandidateTerm], Array]]:
    """Return terms and normalised coefficients of the nominal, the refitted and the identified model.

    A lag below one sample comes from sampling, not from physics: all three models include it. `admissible`:
    the selected terms beside a baseline without negative values, used for the identified model.
    """
    equations = selected.problem.equations
    timing_terms = [c for c in selected.terms if timing and c.effect == timing[0]]
    totals = equations.totals(selected.train)
    refitted = equations.solve(equations.slots(timing_terms), totals)
    nominal = nominal_coefficients(selected.inputs.axis, selected.problem, refitted)
    identified = admissible.problem.equations.solve(equations.slots(selected.terms), totals)
    return [(timing_terms, nominal), (timing_terms, refitted), (selected.terms, identified)]


def nominal_coefficients(axis: NominalAxis, problem: RegressionProblem, refitted: Array) -> Array:
    """Return the normalised coefficients (k,) of the nominal model.

    `refitted` (k,): those of the refitted one. Origins and timing are taken from it: no model file has
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
