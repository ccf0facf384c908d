"""Gradient boosting over the coordinates: what a tool without physics leaves, and which coordinate it used.

It learns what a rigid model leaves of the filtered force on the first three quarters of each recording and is
judged on the last. The Shapley value of a coordinate is its mean share in what is explained there, over all
orders in which coordinates become known; an unknown one takes values of other samples (Covert, Lundberg and
Lee 2020, equations 3 and 6, by marginal sampling).
"""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from sklearn.ensemble import HistGradientBoostingRegressor

from kernels.arrays import Array
from reconcile.examples.real.judged import Judged

COORDINATES = ("position", "velocity", "acceleration", "direction", "time")
SEED, LEARNT = 0, 0.75
MOST_SHARED_OUT = 2000
"""Samples of which the Shapley values are computed."""


def boosted(recordings: Sequence[Judged]) -> Mapping[str, object]:
    """Return the RMS of a rigid model and of boosting on the last quarters, and shares by coordinate."""
    learnt, held = [], []
    for one in recordings:
        kept = one.kept()
        rigid = np.column_stack((one.rigid, np.ones(len(one.rigid))))
        features = np.column_stack((one.position_m, one.rigid[:, 1], one.rigid[:, 0], one.rigid[:, 2]))
        features = np.column_stack((features, one.data.time_s))
        rows = np.column_stack((features, rigid, one.force_n))[kept]
        edge = round(LEARNT * len(rows))
        learnt.append(rows[:edge])
        held.append(rows[edge:])
    train, test = np.concatenate(learnt), np.concatenate(held)
    count = len(COORDINATES)
    theta, *_ = np.linalg.lstsq(train[:, count:-1], train[:, -1], rcond=None)
    left_train, left = (rows[:, -1] - rows[:, count:-1] @ theta for rows in (train, test))
    model = HistGradientBoostingRegressor(random_state=SEED).fit(train[:, :count], left_train)
    some = slice(None, None, max(len(test) // MOST_SHARED_OUT, 1))
    after = left - model.predict(test[:, :count])
    return {
        "refitted": float(np.sqrt(np.mean(left**2))),
        "after": float(np.sqrt(np.mean(after**2))),
        "shapley": shapley(lambda x: np.asarray(model.predict(x)), test[some, :count], left[some]),
    }


def shapley(predict: Callable[[Array], Array], x: Array, y: Array) -> dict[str, float]:
    """Return by coordinate its share of the squares of `y` (n,) that `predict` of `x` (n, k) explains."""
    k = x.shape[1]
    shuffled = x[np.random.default_rng(SEED).permutation(len(x))]
    size = max(float(np.mean(y**2)), 1e-300)
    worth: dict[frozenset[int], float] = {}
    for bits in itertools.product((False, True), repeat=k):
        known = np.array(bits)
        left = y - predict(np.where(known, x, shuffled))
        worth[frozenset(np.flatnonzero(known).tolist())] = 1.0 - float(np.mean(left**2)) / size
    shares = {}
    for index, name in enumerate(COORDINATES[:k]):
        others = [group for group in worth if index not in group]
        weights = [
            math.factorial(len(group)) * math.factorial(k - len(group) - 1) / math.factorial(k)
            for group in others
        ]
        gains = [worth[group | {index}] - worth[group] for group in others]
        shares[name] = float(np.dot(weights, gains))
    return shares
