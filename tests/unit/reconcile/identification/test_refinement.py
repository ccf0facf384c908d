"""Shapes found more finely than the scan has them, and an effect that needs one shape gets one."""

import numpy as np
import pytest
from formula_residuals import problem

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.identification.refinement import NEIGHBOURS, _middle_of_ties, _shape_options, refine
from reconcile.regression.candidate_term import CandidateTerm

STRIBECK_N, STRIBECK_M_S = 5.0, 4.6e-3
SCANNED_M_S = (3.5e-3, 6e-3)
"""The scan's neighbours of it."""


def stribeck(data: object) -> np.ndarray:
    m = data.motion
    return STRIBECK_N * m.direction * np.exp(-((m.velocity_m_s / STRIBECK_M_S) ** 2))


@pytest.mark.parametrize("count", [1, 2])
def test_a_speed_between_those_of_the_scan_is_found(count: int) -> None:
    """From one scanned shape, and from two of which one is too many."""
    wide = problem(stribeck, [("stribeck_friction", (speed,)) for speed in SCANNED_M_S])
    train = np.flatnonzero(wide.equations.samples)
    narrow, best = refine(wide, wide.equations.candidates[:count], train)
    [found] = best
    assert found.effect == "stribeck_friction"
    assert found.shape_parameters[0] == pytest.approx(STRIBECK_M_S, rel=0.04)
    slots = narrow.equations.slots(best)
    coefficients = narrow.equations.denormalised(
        slots, narrow.equations.solve(slots, narrow.equations.totals(train))
    )
    assert coefficients[-1] == pytest.approx(STRIBECK_N, rel=0.04)


def candidate(shape: float, effect: str = "stribeck_friction") -> CandidateTerm:
    return CandidateTerm(effect, (shape,), False, (3,))


def test_neighbours_are_a_ratio_apart_to_either_side() -> None:
    shapes = [shape for (shape,) in _shape_options([], ResidualChannel.FORCE, candidate(1.0), 1.2)]
    assert sorted(shapes) == pytest.approx([1.2**k for k in range(-NEIGHBOURS, NEIGHBOURS + 1)])
    assert shapes[0] == 1.0  # what it is comes first
    assert _shape_options([], ResidualChannel.FORCE, candidate(4.0, "cogging"), 1.2) == [(4.0,)]


def test_of_indistinguishable_shapes_the_middle_one_is_taken() -> None:
    squares = {1.0: 2.0, 2.0: 1.0003, 3.0: 1.0002, 4.0: 1.0, 5.0: 1.5}
    tried = [(candidate(shape), left) for shape, left in squares.items()]
    assert _middle_of_ties(tried).shape_parameters == (3.0,)
    assert _middle_of_ties(tried[:3]).shape_parameters == (3.0,)  # two alike: the better one
