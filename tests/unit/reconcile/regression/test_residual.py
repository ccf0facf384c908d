"""Residuals of a model, against its columns multiplied out by hand."""

import math

import numpy as np
import pytest
from formula_residuals import COULOMB_N, MASS_KG, NOISE_N, problem, residual

from reconcile.regression.residual import residuals, rms

HARMONIC, COGGING_N = 4.0, 3.0


def test_rms_is_over_the_samples_that_count_of_all_recordings() -> None:
    one, other = residual(seed=0), residual(seed=1)
    one = one._replace(after=np.full_like(one.after, 3.0), used=np.arange(len(one.after)) < 100)
    other = other._replace(after=np.full_like(other.after, 4.0), used=np.arange(len(other.after)) < 300)
    assert rms([one, other], "after") == pytest.approx(math.sqrt((100 * 9.0 + 300 * 16.0) / 400))


def test_what_each_model_leaves_is_measured_less_its_columns() -> None:
    found = problem(
        lambda s: COGGING_N * np.sin(HARMONIC * 2.0 * math.pi * s.motion.position_m / s.lead_m),
        [("cogging", (HARMONIC,))],
    )
    equations = found.equations
    [cogging] = equations.candidates
    blocks = np.flatnonzero(equations.samples)
    slots = equations.slots([cogging])
    nothing = np.zeros(len(equations.slots([])))
    given = np.array([MASS_KG, 0.0, COULOMB_N]) / equations.denormalised(equations.slots([]), np.ones(3))
    fitted = equations.solve(slots, equations.totals(blocks))
    held = blocks[3::4]
    [left] = residuals(found, ["run.csv"], [([], nothing), ([], given), ([cogging], fitted)], held)
    y, columns = found.target_and_columns(0)
    assert np.array_equal(left.before, y)
    assert left.refitted == pytest.approx(y - columns[:, :3] @ [MASS_KG, 0.0, COULOMB_N], abs=1e-9)
    assert rms([left], "refitted") == pytest.approx(COGGING_N / math.sqrt(2.0), rel=0.2)
    assert rms([left], "after") < NOISE_N
    assert np.array_equal(np.unique(found.block_of[0][left.held_out]), held)
    assert left.source == "run.csv"
