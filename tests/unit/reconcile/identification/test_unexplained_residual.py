"""A large coloured residual that no effect explains is `unknown`; noise and small shares are not."""

import math

import numpy as np
import pytest
from formula_residuals import MASS_KG, T, residual

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.identification.unexplained_residual import LEAST_SHARE, unexplained_residual

AMPLITUDE_N, SINE_HZ = 6.0, 5.0


def residual_after(amplitude_n: float, refitted_n: float | None = None, noise_n: float = 0.1) -> list:
    """A recording of which a sine is left behind the filter; `refitted_n`: the sine before any effect."""
    clean = residual(noise=noise_n)
    sine = np.sin(2.0 * math.pi * SINE_HZ * np.arange(len(clean.after)) * T)
    before = (amplitude_n if refitted_n is None else refitted_n) * sine
    return [clean._replace(after=clean.after + amplitude_n * sine, refitted=clean.refitted + before)]


def test_a_residual_sine_is_reported_with_amplitude_and_frequency() -> None:
    found = unexplained_residual(residual_after(AMPLITUDE_N), ResidualChannel.FORCE, MASS_KG, None)
    assert found is not None
    assert (found.effect, found.channel) == ("unknown", "force")
    assert found.parameters["rms"].value == pytest.approx(AMPLITUDE_N / math.sqrt(2.0), rel=0.02)
    assert found.confidence == pytest.approx(1.0 - LEAST_SHARE)  # the effects have explained nothing
    assert "half of it below 5" in found.explanation


def test_white_noise_is_no_unexplained_residual() -> None:
    assert unexplained_residual([residual()], ResidualChannel.FORCE, MASS_KG, None) is None


def test_a_small_share_is_no_unexplained_residual() -> None:
    below, above = (AMPLITUDE_N / math.sqrt(LEAST_SHARE * factor) for factor in (0.9, 1.1))
    assert (
        unexplained_residual(residual_after(AMPLITUDE_N, below), ResidualChannel.FORCE, MASS_KG, None) is None
    )
    assert (
        unexplained_residual(residual_after(AMPLITUDE_N, above), ResidualChannel.FORCE, MASS_KG, None)
        is not None
    )


def test_a_deviation_below_an_encoder_count_is_no_unexplained_residual() -> None:
    left = residual_after(AMPLITUDE_N * 1e-6, noise_n=1e-9)
    rms_m = AMPLITUDE_N * 1e-6 / math.sqrt(2.0)
    assert unexplained_residual(left, ResidualChannel.POSITION_DEVIATION, MASS_KG, 1.1 * rms_m) is None
    assert unexplained_residual(left, ResidualChannel.POSITION_DEVIATION, MASS_KG, 0.9 * rms_m) is not None
