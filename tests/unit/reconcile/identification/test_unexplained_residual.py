"""A large coloured residual that no effect explains is `unknown`; noise and small shares are not."""

import math

import numpy as np
import pytest
from formula_residuals import MASS_KG, T, residual

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.identification.accounted import Accounted
from reconcile.identification.findings import IdentifiedEffect
from reconcile.identification.unexplained_residual import (
    BESIDE_EFFECTS,
    LEAST_COUNTS,
    LEAST_STRENGTH,
    unexplained_residual,
    varying_rms,
)
from reconcile.regression.residual import Residual, rms
from reconcile.regression.residual_noise import noise_floor
from reconcile.regression.whiteness import LAGS, whiteness

AMPLITUDE_N, SINE_HZ = 6.0, 5.0
NEW_EACH = 25
"""Samples of a force that is new each time."""


def residual_after(amplitude_n: float, refitted_n: float | None = None, noise_n: float = 0.1) -> list:
    """A recording of which a sine is left behind the filter; `refitted_n`: the sine before any effect."""
    clean = residual(noise=noise_n)
    sine = np.sin(2.0 * math.pi * SINE_HZ * np.arange(len(clean.after)) * T)
    before = (amplitude_n if refitted_n is None else refitted_n) * sine
    return [clean._replace(after=clean.after + amplitude_n * sine, refitted=clean.refitted + before)]


def unexplained(
    left: list[Residual],
    *,
    negligible_rms: float = 0.5,
    resolution_m: float | None = None,
    alone: bool = False,
) -> IdentifiedEffect | None:
    """Return what is reported of a force residual; of the deviation if `negligible_rms` is 0."""
    channel = ResidualChannel.FORCE if negligible_rms else ResidualChannel.POSITION_DEVIATION
    noise = noise_floor(left, channel, MASS_KG).rms
    sizes = Accounted(
        measured=100.0 * negligible_rms,
        rigid=0.0,
        effects={},
        residual=rms(left, "after"),
        noise=noise,
        negligible_rms=negligible_rms,
    )
    return unexplained_residual(left, channel, sizes, resolution_m, alone=alone)


def test_a_residual_sine_is_reported_with_amplitude_and_frequency() -> None:
    found = unexplained(residual_after(AMPLITUDE_N))
    assert found is not None
    assert (found.effect, found.channel) == ("unknown", "force")
    assert found.parameters["rms"].value == pytest.approx(AMPLITUDE_N / math.sqrt(2.0), rel=0.02)
    assert found.confidence > 0.95
    assert "half of it below 5" in found.explanation


def test_white_noise_is_no_unexplained_residual() -> None:
    assert unexplained([residual()]) is None
    assert unexplained([residual()], alone=True) is None


def test_beside_named_effects_a_small_share_is_their_misfit() -> None:
    share = BESIDE_EFFECTS[ResidualChannel.FORCE][-1][1]
    below, above = (AMPLITUDE_N / math.sqrt(share * factor) for factor in (0.9, 1.1))
    assert unexplained(residual_after(AMPLITUDE_N, below)) is None
    assert unexplained(residual_after(AMPLITUDE_N, above)) is not None


def test_alone_it_is_reported_from_a_relevant_size_on() -> None:
    small = residual_after(0.2 * AMPLITUDE_N, AMPLITUDE_N)
    assert unexplained(small) is None
    found = unexplained(small, alone=True)
    assert found is not None
    assert found.parameters["rms"].value == pytest.approx(0.2 * AMPLITUDE_N / math.sqrt(2.0), rel=0.05)
    assert unexplained(small, alone=True, negligible_rms=0.2 * AMPLITUDE_N) is None


def white_after(size_n: float) -> list[Residual]:
    """A recording of which a force is left that is new from one sample of the whiteness test to the next."""
    clean = residual()
    force = size_n * np.random.default_rng(7).standard_normal(len(clean.after) // NEW_EACH + 1)
    steps = np.repeat(force, NEW_EACH)[: len(clean.after)]
    return [clean._replace(after=clean.after + steps, refitted=clean.refitted + steps)]


def test_a_white_force_far_above_the_noise_is_no_noise() -> None:
    noise_n = noise_floor([residual()], ResidualChannel.FORCE, MASS_KG).rms
    least_floors = LEAST_STRENGTH[ResidualChannel.FORCE]
    near, far = white_after(0.4 * least_floors * noise_n), white_after(4.0 * least_floors * noise_n)
    for left in (near, far):
        assert whiteness(left, [left[0].after]).q < 2.0 * LAGS
    assert unexplained(near, alone=True, negligible_rms=0.1 * noise_n) is None
    found = unexplained(far, alone=True, negligible_rms=0.1 * noise_n)
    assert found is not None
    assert found.effect == "unknown"


def test_beside_a_constant_force_a_residual_is_no_misfit() -> None:
    beside = residual_after(AMPLITUDE_N)
    constant = [one._replace(refitted=one.refitted + 100.0 * AMPLITUDE_N) for one in beside]
    assert varying_rms(constant) == pytest.approx(varying_rms(beside))
    assert unexplained(constant) is not None


def test_a_deviation_of_some_counts_is_no_unexplained_residual() -> None:
    left = residual_after(AMPLITUDE_N * 1e-6, noise_n=1e-9)
    rms_m = AMPLITUDE_N * 1e-6 / math.sqrt(2.0)
    assert unexplained(left, negligible_rms=0.0, resolution_m=1.1 * rms_m / LEAST_COUNTS) is None
    assert unexplained(left, negligible_rms=0.0, resolution_m=0.9 * rms_m / LEAST_COUNTS) is not None
