"""Force of an identified model along a recording, and with it the friction that holds a sticking axis."""

from collections.abc import Sequence

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.kinds import IN_A_RECORDING, RegressionData
from reconcile.catalogue.registry import FRICTION, TIMING
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.regression.regression_data import friction_direction
from reconcile.regression.regression_problem import RegressionProblem, predicted_by_model

LEAST_FRICTION_N = 1e-6
"""Friction level below which its share is not computed (division by zero)."""
DELAYING_EFFECTS = frozenset((*TIMING, *(PREFIX + f"moment_of_delay{end}" for end in ("", IN_A_RECORDING))))
"""Effects that are not part of the force, because they delay it."""
NO_LOAD = DELAYING_EFFECTS | FRICTION
"""Effects that are not part of the load of a drive."""


def with_identified_force(
    problem: RegressionProblem, recording: int, slots: Sequence[tuple[int, int]], weights: Array
) -> RegressionData:
    """Set the force of the identified model and the direction of friction in a recording's data.

    `slots`, `weights`: coefficients of the columns before normalisation. In motion the direction is its sign;
    where the axis sticks, it is the share of friction that makes the model's force the measured one.
    """
    data = problem.datasets[recording]
    m = data.motion
    coefficients = [
        (column, weight)
        for (column, owner), weight in zip(slots, weights, strict=True)
        if owner in (-1, recording)
    ]

    def force_n(share: Array | float) -> Array:
        direction = np.where(m.moving, m.direction, share)
        return _force_n(problem, data._replace(motion=m._replace(direction=direction)), coefficients)

    frictionless_n = force_n(0.0)
    level_n = force_n(1.0) - frictionless_n
    direction = friction_direction(
        data, frictionless_n, np.where(level_n > LEAST_FRICTION_N, level_n, np.inf)
    )
    # clipped, because a term in the cube of this force would diverge over the iterations
    largest_n = float(np.abs(data.force_n).max())
    model_force_n = np.clip(force_n(direction) + data.presliding_law_n, -largest_n, largest_n)
    nothing = np.zeros(len(m.position_m))
    still = m._replace(velocity_m_s=nothing, direction=nothing, last_direction=nothing)
    load_n = _force_n(problem, data._replace(motion=still), coefficients, friction=False)
    load_n = np.clip(load_n - data.motor_mass_kg * m.acceleration_m_s2, -largest_n, largest_n)
    return data._replace(motion=m._replace(direction=direction), model_force_n=model_force_n, load_n=load_n)


def _force_n(
    problem: RegressionProblem,
    data: RegressionData,
    coefficients: Sequence[tuple[int, float]],
    *,
    friction: bool = True,
) -> Array:
    """Unfiltered force (n,) of baseline parameters, terms, and terms that the model has already."""
    m, without = data.motion, DELAYING_EFFECTS if friction else NO_LOAD
    base = (m.acceleration_m_s2, m.velocity_m_s, m.direction)
    firsts = np.cumsum([len(base), *(one.width for one in problem.terms)])
    computed, columns = -1, np.zeros((0, 0))
    total_n = np.zeros(len(m.position_m))
    for place, weight in coefficients:
        number = int(np.searchsorted(firsts, place, side="right")) - 1
        if number < 0:
            total_n = total_n + weight * base[place]
            continue
        one = problem.terms[number]
        if one.effect in without:
            continue
        if number != computed:
            computed, columns = number, one.columns(data, one.shape_parameters)
        total_n = total_n + weight * columns[:, place - firsts[number]]
    model_terms = [one for one in problem.model_terms if friction or one.effect not in NO_LOAD]
    return total_n + predicted_by_model(data, problem.channel, model_terms)
