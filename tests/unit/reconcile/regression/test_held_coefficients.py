"""A coefficient that is held at a value: the others are those of a fit to what its column leaves."""

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


@pytest.mark.parametrize("value", [0.0, 30.0])
def test_the_others_are_those_of_a_fit_to_what_its_column_leaves(value: float) -> None:
    found = problem(driving, [("cogging", (1.0,))])
    blocks = np.flatnonzero(found.equations.samples)
    assert BASELINE_PARAMETERS[found.channel][VISCOUS] == "viscous_n_s_m"
    chosen = found.equations.candidates
    slots = found.equations.slots(chosen)

    def fitted(held: bool) -> Array:
        equations = found.equations.held({VISCOUS: value}) if held else found.equations
        return equations.denormalised(slots, equations.solve(slots, equations.totals(blocks)))

    assert fitted(held=False)[VISCOUS] == pytest.approx(-40.0, abs=3.0)
    y, columns = found.target_and_columns(0)
    used = found.used[0]
    others = [place for place in range(columns.shape[1]) if place != VISCOUS]
    [wanted] = np.linalg.lstsq(columns[used][:, others], (y - value * columns[:, VISCOUS])[used], rcond=None)[
        :1
    ]
    held = fitted(held=True)
    assert held[VISCOUS] == pytest.approx(value, abs=1e-6)
    assert held[others] == pytest.approx(wanted, rel=0.02, abs=0.05)
    assert fitted(held=False)[VISCOUS] < 0.0  # what was held is free in the equations it came from
