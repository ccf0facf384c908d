"""Memory that a regression of a long, fast recording takes: that of the kept samples, not of every column."""

import tracemalloc

import numpy as np
import pytest
from known_axis import AXIS, COULOMB_N, MASS_KG

from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.recording.kinematics import kinematics
from reconcile.recording.recording import AxisRecording
from reconcile.regression.regression_data import regression_data
from reconcile.regression.regression_problem import extended, regression_problem
from reconcile.regression.thinning import to_be_thinned

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
        [data], ResidualChannel.FORCE, [("cogging", (1.0,)), ("unknown:force", (0.0, 9.0, 9.0))]
    )
    _, columns = found.target_and_columns(0)
    weights = np.random.default_rng(1).normal(size=columns.shape[1])
    weights[::3] = 0.0
    wanted = [(column, float(weights[column])) for column in np.flatnonzero(weights)]
    assert found.prediction(0, wanted) == pytest.approx(columns @ weights, rel=1e-9, abs=1e-9)


def fast_recording() -> AxisRecording:
    time_s = np.arange(SAMPLES) * PERIOD_S
    position_m = np.round(0.03 * np.sin(3.0 * time_s) / 5e-9) * 5e-9
    velocity_m_s, acceleration_m_s2 = 0.09 * np.cos(3.0 * time_s), -0.27 * np.sin(3.0 * time_s)
    force_n = MASS_KG * acceleration_m_s2 + COULOMB_N * np.sign(velocity_m_s)
    return AxisRecording("fast.csv", "x", PERIOD_S, time_s, position_m, force_n, None, None, None, {})


def test_only_what_memory_asks_for_is_thinned_and_never_below_a_kilohertz() -> None:
    [one], notes = to_be_thinned([fast_recording()])
    assert (one.samples_in_a_mean, notes) == (1, [])
    many, notes = to_be_thinned([fast_recording()] * 3)
    assert [recording.samples_in_a_mean for recording in many] == [2, 2, 2]
    assert len(notes) == 3
    assert "means of each 2" in notes[0].message
    many, _ = to_be_thinned([fast_recording()] * 40)
    assert {recording.samples_in_a_mean for recording in many} == {4}


def test_means_hold_the_same_balance_of_forces_at_a_reversal_too() -> None:
    whole = regression_data(fast_recording(), AXIS)
    means = regression_data(fast_recording()._replace(samples_in_a_mean=4), AXIS)
    assert means.period_s == 4.0 * PERIOD_S
    assert len(means.force_n) == len(means.motion.moving) == SAMPLES // 4
    for data in (whole, means):
        m = data.motion
        left_n = data.force_n - MASS_KG * m.acceleration_m_s2 - COULOMB_N * m.direction
        inner = slice(100, -100)
        assert np.abs(left_n[inner][m.moving[inner]]).max() < 0.3
    turns = np.flatnonzero(np.abs(np.diff(whole.motion.last_direction)) > 0.0)
    assert len(turns) == pytest.approx(len(np.flatnonzero(np.diff(means.motion.last_direction))), abs=1)


def test_spare_columns_take_no_products_before_they_are_filled(fast_data: RegressionData) -> None:
    shapes = [("cogging", (1.0,))]
    without, wide = (
        regression_problem([fast_data], ResidualChannel.FORCE, shapes, only=True, spare=spare).equations
        for spare in (0, 90)
    )
    assert wide.gram.nbytes + wide.border.nbytes == without.gram.nbytes + without.border.nbytes
    assert wide.gram == pytest.approx(without.gram, rel=1e-9, abs=1e-9)


def test_further_terms_in_spare_columns_are_those_of_a_problem_with_them(fast_data: RegressionData) -> None:
    short = fast_data._replace(
        time_s=fast_data.time_s[:40_000],
        force_n=fast_data.force_n[:40_000],
        model_force_n=fast_data.model_force_n[:40_000],
        motion=kinematics(fast_data.motion.position_m[:40_000], PERIOD_S),
    )
    more = [("unknown:position", (-0.03, 0.03, 9.0), False), ("unknown:relaxation", (0.1,), False)]
    shapes = [("cogging", (1.0,))]
    narrow = regression_problem([short], ResidualChannel.FORCE, shapes, only=True, spare=18)
    extended(narrow, [("unknown:velocity", (-0.1, 0.1, 9.0), False)])
    whole = regression_problem(
        [short], ResidualChannel.FORCE, [*shapes, *(key[:2] for key in more)], only=True
    )
    again = extended(narrow, more)
    blocks = np.flatnonzero(whole.equations.samples)
    for one in (whole, again):
        assert {c.effect for c in one.equations.candidates} == {"cogging", *(name for name, *_ in more)}
    solutions = [
        one.equations.denormalised(slots, one.equations.solve(slots, one.equations.totals(blocks)))
        for one in (whole, again)
        if (slots := one.equations.slots(one.equations.candidates))
    ]
    assert solutions[0] == pytest.approx(solutions[1], rel=1e-6, abs=1e-9)
