"""The tool's rivals in `make bench-real`: least squares with textbook friction, and gradient boosting.

All are fitted on the same filtered samples as the tool, and none sees the recording that it is judged on.
"""

from collections.abc import Callable, Sequence

import numpy as np
from sklearn.ensemble import HistGradientBoostingRegressor

from kernels.arrays import Array
from reconcile.regression.regression_data import low_pass_of
from tests.campaigns.bench.real_data import Judged

Predict = Callable[[Judged], Array]
"""Force of a fitted model along a recording, N (n,)."""

STRIBECK_SHARES = (0.01, 0.02, 0.05, 0.1, 0.2, 0.4)
"""Stribeck speeds that are tried, of the 95th percentile of the speed."""
SEED = 0


def rigid(train: Sequence[Judged]) -> Predict:
    """Mass, viscous and Coulomb friction."""
    return _least_squares(train, lambda one: one.rigid)[0]


def least_squares(train: Sequence[Judged]) -> Predict:
    """The rigid model with Stribeck and asymmetric friction and a constant force; the best Stribeck speed."""
    speeds = np.concatenate([np.abs(one.data.motion.velocity_m_s[one.used]) for one in train])
    fast_m_s = float(np.percentile(speeds, 95.0))
    fits = [_least_squares(train, _textbook(share * fast_m_s)) for share in STRIBECK_SHARES]
    return min(fits, key=lambda fit: fit[1])[0]


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


def _textbook(stribeck_m_s: float) -> Callable[[Judged], Array]:
    def columns(one: Judged) -> Array:
        m, low_pass = one.data.motion, low_pass_of(one.data)
        stribeck = m.direction * np.exp(-((m.velocity_m_s / stribeck_m_s) ** 2))
        others = np.column_stack((stribeck, np.abs(m.velocity_m_s), np.ones(len(stribeck))))
        return np.column_stack((one.rigid, low_pass(others)))

    return columns


def _least_squares(train: Sequence[Judged], columns: Callable[[Judged], Array]) -> tuple[Predict, float]:
    """The fitted model, and its mean square on the samples that it was fitted on."""
    x = np.concatenate([columns(one)[one.kept()] for one in train])
    y = np.concatenate([one.force_n[one.kept()] for one in train])
    theta, *_ = np.linalg.lstsq(x, y, rcond=None)
    return lambda one: columns(one) @ theta, float(np.mean((y - x @ theta) ** 2))
