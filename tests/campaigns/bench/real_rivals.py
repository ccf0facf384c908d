"""The tool's rivals in `make bench-real`: least squares with textbook friction, and gradient boosting.

All are fitted on the same filtered samples as the tool, and none sees the recording that it is judged on.
"""

from collections.abc import Callable, Sequence

import numpy as np
from sklearn.ensemble import HistGradientBoostingRegressor

from kernels.arrays import Array
from reconcile.examples.real.judged import Judged
from reconcile.examples.real.textbook import Predict, least_squares, rigid

SEED = 0


def boosting(train: Sequence[Judged]) -> Predict:
    """Gradient boosting with the library's own settings."""
    x = np.concatenate([_features(one)[one.kept()] for one in train])
    y = np.concatenate([one.force_n[one.kept()] for one in train])
    fitted = HistGradientBoostingRegressor(random_state=SEED).fit(x, y)
    return lambda one: np.asarray(fitted.predict(_features(one)), dtype=np.float64)


RIVALS: dict[str, Callable[[Sequence[Judged]], Predict]] = {
    "rigid": rigid,
    "least_squares": least_squares,
    "boosting": boosting,
}


def _features(one: Judged) -> Array:
    """Position, velocity, acceleration and direction, behind the filter (n, 4)."""
    return np.column_stack((one.position_m, one.rigid))
