"""Whiteness of a residual.

The state filter correlates white noise over a few milliseconds. The residual is therefore sampled at
distances at which that correlation has decayed; correlation that remains is not noise. Source: Ljung and Box
(1978).
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from kernels.arrays import Array
from reconcile.regression.filter_ends import CORNER_RAD_S
from reconcile.regression.residual import Residual

SPACING_TIME_CONSTANTS = 9.5
"""Distance of the samples tested for whiteness, in time constants of the filter, whose own correlation is
0.3 % by then."""
LAGS = 20
"""Lags of the whiteness test, its degrees of freedom."""


class Whiteness(NamedTuple):
    """Autocorrelation of a residual."""

    lags_s: Array
    correlation: Array
    bound: float
    """95 % of the correlations of white noise are within +-`bound`."""
    q: float
    """Ljung-Box statistic, `LAGS` degrees of freedom."""
    probability: float
    """Probability that white noise has a larger statistic."""


def whiteness(residuals: Sequence[Residual], values: Sequence[Array]) -> Whiteness:
    """Test the residuals of one model, (n,) for each recording, for whiteness."""
    period_s = residuals[0].data.period_s
    step = max(math.ceil(SPACING_TIME_CONSTANTS / CORNER_RAD_S / period_s), 1)
    used = [residual.used for residual in residuals]
    mean = float(np.concatenate([of[use] for of, use in zip(values, used, strict=True)]).mean())
    spaced = [(of - mean)[::step] for of in values]
    products, pairs = lagged_products(spaced, [use[::step] for use in used], LAGS)
    count = max(float(pairs[0]), 1.0)
    variance = float(products[0]) / count
    lags_s = np.arange(1.0, LAGS + 1.0) * (step * period_s)
    if variance <= 0.0:
        return Whiteness(lags_s, np.zeros(LAGS), 0.0, 0.0, 1.0)
    correlation = products[1:] / np.maximum(pairs[1:], 1.0) / variance
    # gaps leave fewer pairs for a lag than one long series has, so each lag is weighted with its own count
    q = float((count + 2.0) / count * (pairs[1:] * correlation**2).sum())
    return Whiteness(lags_s, correlation, 1.96 / math.sqrt(count), q, float(chi2.sf(q, LAGS)))


def lagged_products(
    values: Sequence[Array], used: Sequence[NDArray[np.bool_]], lags: int
) -> tuple[Array, Array]:
    """Sums of the products of samples in use, and their numbers, at each lag from 0 on (lags + 1,)."""
    products, pairs = np.zeros(lags + 1), np.zeros(lags + 1)
    for of, use in zip(values, used, strict=True):
        counted, weight = of * use, use.astype(np.float64)
        for lag in range(min(lags + 1, len(of))):
            products[lag] += counted[lag:] @ counted[: len(of) - lag]
            pairs[lag] += weight[lag:] @ weight[: len(of) - lag]
    return products, pairs
