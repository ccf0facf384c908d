"""Memory that a regression of a long, fast recording takes: that of the kept samples, not of every column."""

import tracemalloc

import numpy as np
import pytest
from known_axis import AXIS, COULOMB_N, MASS_KG

from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.recording.kinematics import kinematics
from reconcile.regression.regression_problem import regression_problem

PERIOD_S, SAMPLES = 0.25e-3, 160_000
LARGEST_SHARE = 0.3
"""Of the memory that all columns take at every sample; every 16th is kept, and normal equations beside it."""


@pytest.fixture(scope="module")
def fast_data() -> RegressionData:
    time_s = np.arange(SAMPLES) * PERIOD_S
    position_m = np.round(0.03 * np.sin(3.0 * time_s) / 5e-9) * 5e-9
    motion = kinematics(position_m, PERIOD_S)
    force_n = MASS_KG * motion.acceleration_m_s2 + COULOMB_N * motion.direction
    return RegressionData(PERIOD_S, time_s, motion, force_n, force_n, AXIS.lead_m, 0.0, None, None, others={})


def test_memory_does_not_grow_with_every_column_at_every_sample(fast_data: RegressionData) -> None:
    tracemalloc.start()
    try:
        found = regression_problem([fast_data], ResidualChannel.FORCE)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    columns = found.equations.gram.shape[1]
    assert columns > 150
    assert peak < LARGEST_SHARE * SAMPLES * columns * 8


def test_a_prediction_is_the_weighted_sum_of_all_columns(fast_data: RegressionData) -> None:
    short = 8000
    data = fast_data._replace(
        time_s=fast_data.time_s[:short],
        force_n=fast_data.force_n[:short],
        model_force_n=fast_data.model_force_n[:short],
        motion=kinematics(fast_data.motion.position_m[:short], PERIOD_S),
    )
    found = regression_problem(
        [data], ResidualChannel.FORCE, [("cogging", (1.0,)), ("unknown:force", (0.0, 9.0))]
    )
    _, columns = found.target_and_columns(0)
    weights = np.random.default_rng(1).normal(size=columns.shape[1])
    weights[::3] = 0.0
    wanted = [(column, float(weights[column])) for column in np.flatnonzero(weights)]
    assert found.prediction(0, wanted) == pytest.approx(columns @ weights, rel=1e-9, abs=1e-9)
