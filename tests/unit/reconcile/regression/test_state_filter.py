"""The state-variable filter against scipy's, and against the derivatives of a slow sine."""

import math

import numpy as np
import pytest
from scipy.signal import bilinear, lfilter

from kernels.arrays import Array
from reconcile.regression.state_filter import StateFilter

PERIOD_S, BANDWIDTH_HZ, N = 1e-3, 20.0, 5000
STEPS = np.random.default_rng(7).normal(size=(N, 3)).cumsum(axis=0)


@pytest.mark.parametrize("derivative", [0, 1, 2])
@pytest.mark.parametrize("signal", [STEPS, STEPS[:, 1], STEPS.T[0], np.round(STEPS).astype(int)])
def test_it_is_scipys_filter(signal: Array, derivative: int) -> None:
    w = 2.0 * math.pi * BANDWIDTH_HZ
    b, a = bilinear([w**3] + [0.0] * derivative, [1.0, 3.0 * w, 3.0 * w**2, w**3], 1.0 / PERIOD_S)
    level = signal[:1] if derivative == 0 else 0.0
    expected = lfilter(b, a, signal - signal[:1], axis=0) + level
    found = StateFilter(PERIOD_S, BANDWIDTH_HZ)(signal, derivative)
    assert found.shape == signal.shape
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-13 * np.abs(expected).max())


@pytest.mark.parametrize("derivative", [1, 2])
def test_it_differentiates_behind_its_low_pass(derivative: int) -> None:
    """In the steady state a sine comes out times (j v)^k L_0(j v), v as the bilinear transform warps it."""
    hz, bandwidth = 3.0, 2.0 * math.pi * BANDWIDTH_HZ
    t = np.arange(N) * PERIOD_S
    v = 2.0 / PERIOD_S * math.tan(math.pi * hz * PERIOD_S)
    response = (1j * v) ** derivative * (bandwidth / (1j * v + bandwidth)) ** 3
    low_pass = StateFilter(PERIOD_S, BANDWIDTH_HZ)
    found = low_pass(np.sin(2.0 * math.pi * hz * t), derivative)
    expected = (response * np.exp(2j * math.pi * hz * t)).imag
    settled = slice(2 * low_pass.settled, None)
    np.testing.assert_allclose(found[settled], expected[settled], atol=1e-6 * abs(response))
