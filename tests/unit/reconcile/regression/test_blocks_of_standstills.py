"""Long standstills take no block from the motion; ordinary pauses leave blocks of equal time."""

import math

import numpy as np
from formula_residuals import data

from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.recording.kinematics import kinematics
from reconcile.regression.blocks import FEWEST_BLOCKS
from reconcile.regression.regression_problem import RegressionProblem, regression_problem

T = 1e-3


def moving_between(rests_s: float) -> RegressionData:
    """Two strokes of two seconds, with a rest before, between and after them."""
    phase = np.linspace(0.0, 2.0 * math.pi, 2000)
    stroke_m = 5e-3 * (1.0 - np.cos(phase)) * (1.0 + 0.3 * np.sin(3.0 * phase))
    rest_m = np.zeros(round(rests_s / T))
    x = np.concatenate((rest_m, stroke_m, rest_m, stroke_m, rest_m))
    motion = kinematics(np.round(x / 5e-9) * 5e-9, T)
    force_n = 50.0 * motion.acceleration_m_s2 + 12.0 * motion.last_direction
    of = data()._replace(time_s=np.arange(len(x)) * T, motion=motion)
    return of._replace(force_n=force_n, model_force_n=force_n)


def problem(of: RegressionData, channel: ResidualChannel = ResidualChannel.FORCE) -> RegressionProblem:
    return regression_problem([of._replace(scale_m=of.motion.position_m)], channel, only=True)


def in_use(of: RegressionProblem) -> int:
    return int((of.equations.samples > 0).sum())


def test_the_motion_has_as_many_blocks_however_long_the_axis_stands() -> None:
    counts = [in_use(problem(moving_between(rests_s))) for rests_s in (8.0, 20.0, 60.0)]
    assert min(counts) >= FEWEST_BLOCKS - 2
    assert np.ptp(counts) <= 2


def test_a_standstill_belongs_to_the_block_before_it() -> None:
    [block] = problem(moving_between(20.0)).block_of
    assert (np.diff(block) >= 0).all()
    assert np.ptp(block[24_000:40_000]) == 0


def test_ordinary_pauses_are_in_blocks_of_equal_time() -> None:
    [block] = problem(data()).block_of
    assert np.ptp(np.bincount(block)) <= 1


def test_the_deviation_counts_standstills_as_well() -> None:
    [block] = problem(moving_between(20.0), ResidualChannel.POSITION_DEVIATION).block_of
    assert np.ptp(np.bincount(block)) <= 1
