"""The low pass of the learning law is scipy's Gaussian filter, to the bit, without loading scipy."""

import math

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from servo_ctrl.learning.reversal_waveform import LoopModel, missing_force_n

FORCE_PER_ERROR = LoopModel(
    mass_kg=0.0,
    kp_1_s=0.0,
    kv_n_s_m=0.0,
    ki_n_m=1.0,
    period_s=0.001,
    lead_s=0.0,
    slip_m=(),
    ahead_s=0.0,
    rest_span_m=0.0,
)
"""A loop whose missing force is the low-passed error itself."""


@pytest.mark.parametrize("period_s", [0.00025, 0.001, 0.002])
@pytest.mark.parametrize("samples", [2, 7, 450])
def test_the_low_pass_has_the_bits_of_the_librarys(period_s: float, samples: int) -> None:
    error_m = np.cumsum(np.random.default_rng(samples).normal(size=samples))
    loop = FORCE_PER_ERROR._replace(period_s=period_s)
    expected = gaussian_filter1d(error_m, 1.0 / (2.0 * math.pi * 80.0 * period_s), mode="nearest")
    np.testing.assert_array_equal(missing_force_n(loop, error_m), expected)
