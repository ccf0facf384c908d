"""An effect is named where it matters: by its share of the force, in the deviation by the sensors' count."""

import numpy as np
import pytest
from known_axis import COUNT_M, T, regression_data_of

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.identification.accounted import Accounted, accounted
from reconcile.regression.regression_problem import regression_problem

SCALE_COUNT_M = 1e-7
LEAD_ERROR = "lead_error_cumulative"


@pytest.mark.parametrize(("counts", "is_named"), [(0.4, False), (0.8, True)])
def test_a_lead_error_is_named_from_a_count_of_the_scale_on(counts: float, is_named: bool) -> None:
    """RMS in counts; the fit tells either to a few hundredths, and not whether it is the grating's own."""
    position_m = 0.003 * np.sin(0.5 * np.pi * np.arange(8_000) * T)
    data = regression_data_of(position_m)
    relative = counts * SCALE_COUNT_M / float(np.std(data.motion.position_m))
    scale_m = np.rint((1.0 + relative) * data.motion.position_m / SCALE_COUNT_M) * SCALE_COUNT_M
    deviation = ResidualChannel.POSITION_DEVIATION
    problem = regression_problem([data._replace(scale_m=scale_m)], deviation, [(LEAD_ERROR, ())], only=True)
    equations, terms = problem.equations, problem.equations.candidates
    slots = equations.slots(terms)
    theta = equations.solve(slots, equations.totals(np.arange(len(equations.samples))))
    sizes = accounted(problem, terms, equations.denormalised(slots, theta), noise=COUNT_M, share=0.01)
    assert sizes.effects[LEAD_ERROR] == pytest.approx(counts * SCALE_COUNT_M, rel=0.15)
    assert sizes.is_relevant(LEAD_ERROR) is is_named


@pytest.mark.parametrize(("effect_n", "is_named"), [(0.8, False), (1.2, True)])
def test_what_is_small_beside_the_unexplained_may_be_a_part_of_it(effect_n: float, is_named: bool) -> None:
    sizes = Accounted(
        measured=50.0,
        rigid=49.0,
        effects={"constant_force": effect_n},
        residual=2.1,
        noise=0.2,
        negligible_rms=0.5,
    )
    assert sizes.is_relevant("constant_force") is is_named
