"""Divides the blocks of recordings into those of the fits and the held-out ones that judge the model."""

import math

import numpy as np

from kernels.arrays import Index
from reconcile.regression.regression_problem import RegressionProblem

STRETCH_BLOCKS, HELD_OUT_EVERY = 4, 4
"""Blocks of a stretch, and the period of held-out stretches: 25 % of the blocks are held out."""


def training_and_held_out(problem: RegressionProblem) -> tuple[Index, Index]:
    """Return training and held-out blocks: of each recording every fourth stretch is held out.

    Recordings shorter than four stretches count theirs together, so that several of them have held-out ones;
    a single one has none: the search needs all of it.
    """
    equations = problem.equations
    held_out, stretches_of_short = [np.zeros(0, dtype=np.int64)], 0
    for recording in range(equations.recordings):
        own = np.flatnonzero((equations.recording_of_block == recording) & (equations.samples > 0))
        stretch = np.arange(len(own)) // STRETCH_BLOCKS
        if len(own) <= STRETCH_BLOCKS * (HELD_OUT_EVERY - 1):
            stretch += stretches_of_short
            stretches_of_short += math.ceil(len(own) / STRETCH_BLOCKS)
        held_out.append(own[stretch % HELD_OUT_EVERY == HELD_OUT_EVERY - 1])
    blocks = np.concatenate(held_out)
    return np.setdiff1d(np.flatnonzero(equations.samples > 0), blocks), blocks
