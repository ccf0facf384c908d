"""A coefficient that is held at zero: the others are those of a fit without its column."""

import numpy as np
import pytest
from formula_residuals import problem

from kernels.arrays import Array
from reconcile.catalogue.kinds import RegressionData
from reconcile.regression.regression_problem import BASELINE_PARAMETERS

VISCOUS = 1


def driving(given: RegressionData) -> Array:
    """Less force the faster it goes, as if viscous friction drove the axis, and a cogging."""
    return -40.0 * given.motion.velocity_m_s + 2.0 * np.sin(
        2.0 * np.pi * given.motion.position_m / given.lead_m
    )


def test_the_others_are_those_of_a_fit_without_its_column() -> None:
    found = problem(driving, [("cogging", (1.0,))])
    blocks = np.flatnonzero(found.equations.samples)
    assert BASELINE_PARAMETERS[found.channel][VISCOUS] == "viscous_n_s_m"
    chosen = found.equations.candidates
    slots = found.equations.slots(chosen)

    def fitted(held: bool) -> Array:
        equations = found.equations.held_at_zero([VISCOUS]) if held else found.equations
        return equations.denormalised(slots, equations.solve(slots, equations.totals(blocks)))

    assert fitted(held=False)[VISCOUS] == pytest.approx(-40.0, abs=3.0)
    y, columns = found.target_and_columns(0)
    used = found.used[0]
    others = [place for place in range(columns.shape[1]) if place != VISCOUS]
    [wanted] = np.linalg.lstsq(columns[used][:, others], y[used], rcond=None)[:1]
    held = fitted(held=True)
    assert abs(held[VISCOUS]) < 1e-6
    assert held[others] == pytest.approx(wanted, rel=0.02, abs=0.05)
    assert fitted(held=False)[VISCOUS] < 0.0  # what was held is free in the equations it came from
