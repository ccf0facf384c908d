"""Models for comparison, fitted by least squares after the filter: rigid, and textbook friction."""

from collections.abc import Callable, Sequence

import numpy as np

from kernels.arrays import Array
from reconcile.examples.real.judged import Judged
from reconcile.regression.regression_data import low_pass_of

Predict = Callable[[Judged], Array]
"""Force of a fitted model along a recording, N (n,)."""

COLLINEAR = 1e-2
"""Singular values of columns of unit size, relative to the largest, below which a direction is omitted:
motions in one direction do not distinguish Coulomb friction from a constant force.
"""
STRIBECK_SHARES = (0.01, 0.02, 0.05, 0.1, 0.2, 0.4)
"""Tried Stribeck speeds, share of the 95th percentile of the speed."""


def rigid(train: Sequence[Judged]) -> Predict:
    """Fit mass, viscous and Coulomb friction."""
    return _least_squares(train, lambda one: one.rigid)[0]


def least_squares(train: Sequence[Judged]) -> Predict:
    """Fit the rigid model with Stribeck and asymmetric friction, a constant force, best Stribeck speed."""
    speeds = np.concatenate([np.abs(one.data.motion.velocity_m_s[one.used]) for one in train])
    fast_m_s = float(np.percentile(speeds, 95.0))
    fits = [_least_squares(train, _textbook(share * fast_m_s)) for share in STRIBECK_SHARES]
    return min(fits, key=lambda fit: fit[1])[0]


def _textbook(stribeck_m_s: float) -> Callable[[Judged], Array]:
    def columns(one: Judged) -> Array:
        m, low_pass = one.data.motion, low_pass_of(one.data)
        stribeck = m.direction * np.exp(-((m.velocity_m_s / stribeck_m_s) ** 2))
        others = np.column_stack((stribeck, np.abs(m.velocity_m_s), np.ones(len(stribeck))))
        return np.column_stack((one.rigid, low_pass(others)))

    return columns


def _least_squares(train: Sequence[Judged], columns: Callable[[Judged], Array]) -> tuple[Predict, float]:
    """Return the fitted model, and its mean square error on the fitted samples."""
    x = np.concatenate([columns(one)[one.kept()] for one in train])
    y = np.concatenate([one.force_n[one.kept()] for one in train])
    scale = np.sqrt(np.mean(x**2, axis=0)) + 1e-300
    theta = np.linalg.lstsq(x / scale, y, rcond=COLLINEAR)[0] / scale
    return lambda one: columns(one) @ theta, float(np.mean((y - x @ theta) ** 2))
