"""The wide Gaussian, filtered by its transfer function, is the sum over its taps."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.ndimage import gaussian_filter1d

from reconcile.recording.gaussian_low_pass import gaussian_low_pass

RNG = np.random.default_rng(5)


@pytest.mark.parametrize("width", [0.7, 7.0, 8.0, 31.3])
@pytest.mark.parametrize("shape", [(1500,), (1500, 3), (40,)])
def test_it_is_the_sum_over_the_taps(width: float, shape: tuple[int, ...]) -> None:
    signal = 0.4 + np.cumsum(RNG.normal(0.0, 1e-3, shape), axis=0)
    assert_allclose(
        gaussian_low_pass(signal, width), gaussian_filter1d(signal, width, axis=0, mode="nearest"), rtol=1e-13
    )


@pytest.mark.parametrize("width", [3.0, 50.0])
def test_the_gain_of_a_sine_is_the_gaussians(width: float) -> None:
    """The transform of a Gaussian of standard deviation s is exp(-(2 pi f s)^2 / 2)."""
    cycles_per_sample = 0.15 / width
    turns = 2.0 * np.pi * cycles_per_sample * np.arange(4000)
    inside = slice(1000, 3000)
    gain = np.exp(-0.5 * (2.0 * np.pi * cycles_per_sample * width) ** 2)
    assert_allclose(gaussian_low_pass(np.sin(turns), width)[inside], gain * np.sin(turns)[inside], atol=1e-4)


def test_a_constant_is_kept_to_the_bit() -> None:
    assert np.array_equal(gaussian_low_pass(np.full(900, 0.1), 40.0), np.full(900, 0.1))
