"""Divides the blocks of recordings into those of the fits and the held-out ones that judge the model."""

import numpy as np

from kernels.arrays import Index
from reconcile.regression.regression_problem import RegressionProblem

STRETCH_BLOCKS, HELD_OUT_EVERY = 4, 4
"""Blocks of a stretch, and the period of held-out stretches: 25 % of the blocks are held out."""


def training_and_held_out(problem: RegressionProblem) -> tuple[Index, Index]:
    """Return training and held-out blocks: of each recording every fourth stretch is held out.

    A recording shorter than four stretches has no held-out block: the search needs all of it.
    """
    equations = problem.equations
    train, held_out = [], []
    for recording in range(equations.recordings):
        own = np.flatnonzero((equations.recording_of_block == recording) & (equations.samples > 0))
        is_held_out = np.arange(len(own)) // STRETCH_BLOCKS % HELD_OUT_EVERY == HELD_OUT_EVERY - 1
        train.append(own[~is_held_out])
        held_out.append(own[is_held_out])
    return np.concatenate(train), np.concatenate(held_out)
