"""Which terms of a fitted problem physics refuses: by effect, with all friction judged together."""

import math

import numpy as np
import pytest
from formula_residuals import MASS_KG, data, problem
from known_axis import AXIS

from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.catalogue.unnamed_terms import columns_of
from reconcile.regression.physical_veto import moved_kg, vetoed
from reconcile.regression.regression_problem import RegressionProblem

TERMS = [("cogging", (4.0,)), ("stribeck_friction", (2e-2,)), ("asymmetric_viscous_friction", ())]


def cogging_and_stribeck(of: RegressionData) -> np.ndarray:
    ripple = 3.0 * np.sin(4.0 * 2.0 * math.pi * of.motion.position_m / of.lead_m)
    return ripple - 7.0 * of.motion.direction * np.exp(-((of.motion.velocity_m_s / 2e-2) ** 2))


@pytest.fixture(scope="module")
def fitted() -> tuple[RegressionProblem, np.ndarray]:
    found = problem(cogging_and_stribeck, TERMS, noise=0.01)
    equations, chosen = found.equations, found.equations.candidates
    slots = equations.slots(chosen)
    theta = equations.solve(slots, equations.totals(np.flatnonzero(equations.samples)))
    return found, equations.denormalised(slots, theta)


def test_what_is_there_is_admitted(fitted: tuple[RegressionProblem, np.ndarray]) -> None:
    found, weights = fitted
    assert vetoed(found, found.equations.candidates, weights, AXIS) == {}


def test_a_friction_that_pushes_is_refused_by_its_name(fitted: tuple[RegressionProblem, np.ndarray]) -> None:
    found, weights = fitted
    chosen = found.equations.candidates
    of = [c.effect for c in chosen]
    first = len(found.baseline_names)
    place = {name: first + sum(len(c.columns) for c in chosen[: of.index(name)]) for name in of}
    dip = weights.copy()
    dip[place["stribeck_friction"]] = -60.0
    refused = vetoed(found, chosen, dip, AXIS)
    assert set(refused) == {"stribeck_friction", "asymmetric_viscous_friction"}  # nobody knows which of them
    assert "would push" in refused["stribeck_friction"]


def test_a_term_of_the_baseline_is_refused() -> None:
    """Behind a sine alone a spring is a mass."""
    time_s = data().time_s
    found = problem(lambda of: 0.0 * of.time_s, [("position_dependent_force", (1.0, 0.0, 0.03))])
    chosen = found.equations.candidates
    weights = np.array([50.0, 0.0, 12.0, 1.0])
    assert vetoed(found, chosen, weights, AXIS) == {}  # two sines: they are told apart
    assert len(time_s) == len(found.used[0])


def test_a_mass_on_a_spring_belongs_to_the_moved_mass() -> None:
    """Else a joint whose link swings would lose its inertia to the link, and all that was found beside it."""
    ringing, carried_kg = ("unknown:ringing", (8.0,)), 20.0
    columns = columns_of(ringing[0], ResidualChannel.FORCE)
    assert columns is not None
    found = problem(lambda of: carried_kg * columns(of, ringing[1])[:, 0], [ringing], noise=0.01)
    totals = found.equations.totals(np.flatnonzero(found.equations.samples))
    assert moved_kg(found, found.equations.candidates, totals) == pytest.approx(
        MASS_KG + carried_kg, rel=0.02
    )
