"""Effects that absorb the inertia: beside them hardly any mass is left, as no axis has it."""

from collections.abc import Sequence

from kernels.arrays import Index
from reconcile.catalogue.gravity import ENTRY as GRAVITY_ENTRY
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.regression.candidate_term import CandidateTerm, effect_names
from reconcile.regression.physical_veto import moved_kg
from reconcile.regression.regression_problem import RegressionProblem

GRAVITY = GRAVITY_ENTRY.name
LEAST_MASS_SHARE = 0.3
"""Least mass fitted beside the effects, over that of a rigid model with gravity; if less, an effect has
absorbed the inertia. Chosen: plausible forces change the fitted mass far less."""
LEAST_NOMINAL_SHARE = 0.01
"""Least mass over the nominal one, which may be far off; chosen."""


def absorbing_mass(
    problem: RegressionProblem, terms: Sequence[CandidateTerm], train: Index, nominal_kg: float
) -> dict[str, str]:
    """Return the effect, if any, that has absorbed nearly all of the mass fitted to a force, and why."""
    totals = problem.equations.totals(train)

    def mass_kg(chosen: Sequence[CandidateTerm]) -> float:
        return moved_kg(problem, chosen, totals)

    # a weight on a joint dominates its torque, and falsifies the mass of a model without it
    weights = [c for c in terms if c.effect == GRAVITY]
    named = [e for e in effect_names(terms) if not e.startswith(PREFIX) and e != GRAVITY]
    rigid_kg = mass_kg(weights)
    if weights and rigid_kg < LEAST_NOMINAL_SHARE * nominal_kg:
        named, rigid_kg = [GRAVITY], mass_kg([])
    least_kg = max(LEAST_MASS_SHARE * rigid_kg, LEAST_NOMINAL_SHARE * nominal_kg)
    # a motion without observable mass, as at constant speed, cannot reject it
    if not named or rigid_kg <= 0.0 or mass_kg(terms) >= least_kg:
        return {}
    others_kg = {effect: mass_kg([c for c in terms if c.effect != effect]) for effect in named}
    worst = max(others_kg, key=lambda effect: others_kg[effect])
    why = f"beside it the mass would be {mass_kg(terms):.3g} kg, {rigid_kg:.3g} kg without any effect"
    return {worst: why}
