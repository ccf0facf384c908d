"""The noise floor of noise is the noise itself; white means uncorrelated beyond the filter."""

import math

import numpy as np
import pytest
from formula_residuals import MASS_KG, NOISE_N, N, T, data, residual
from scipy.signal import lfilter

from reconcile.catalogue.kinds import ResidualChannel
from reconcile.regression.filter_ends import FILTER_HZ
from reconcile.regression.residual_noise import noise_floor, noise_json, spectral_density
from reconcile.regression.state_filter import StateFilter
from reconcile.regression.whiteness import whiteness

ENBW_HZ = FILTER_HZ * 3.0 * math.pi / 16.0
"""Of three equal poles: the integral of (1 + (f / f0)^2)^-3."""


def test_white_noise_of_the_force_is_its_own_floor() -> None:
    expected = NOISE_N * math.sqrt(ENBW_HZ * 2.0 * T)
    assert noise_floor([residual()], ResidualChannel.FORCE, MASS_KG).rms == pytest.approx(expected, rel=0.1)


def test_encoder_noise_is_distinguished_from_its_image_in_the_force() -> None:
    low_pass, white = StateFilter(T, FILTER_HZ), np.random.default_rng(3).normal(size=N) * 2e-8
    image = MASS_KG * low_pass(white, 2)
    quiet = residual()._replace(after=image)
    assert noise_floor([quiet], ResidualChannel.FORCE, MASS_KG).rms == pytest.approx(
        image[500:].std(), rel=0.15
    )


def test_structured_residuals_do_not_raise_the_noise_floor() -> None:
    noise = residual()
    resonance = 5.0 * np.sin(2.0 * math.pi * 130.0 * noise.data.time_s)
    drift = np.cumsum(np.random.default_rng(5).normal(size=N)) * 0.02
    plain = noise_floor([noise], ResidualChannel.FORCE, MASS_KG).rms
    loud = noise._replace(after=noise.after + StateFilter(T, FILTER_HZ)(resonance + drift))
    assert noise_floor([loud], ResidualChannel.FORCE, MASS_KG).rms == pytest.approx(plain, rel=0.15)


def test_the_floor_is_not_below_the_steps_of_the_sensors() -> None:
    s = data()
    steps = s._replace(force_n=np.round(s.force_n / 0.5) * 0.5)
    found = noise_floor(
        [residual(of=steps, noise=0.0)._replace(after=np.full(N, 1.0))], ResidualChannel.FORCE, MASS_KG
    )
    expected = 0.5 / math.sqrt(12.0) * math.sqrt(ENBW_HZ * 2.0 * T)
    assert found.rms == pytest.approx(found.steps)
    assert found.steps == pytest.approx(expected, rel=0.1)


def test_the_density_adds_up_to_the_variance() -> None:
    noise = residual()
    frequency_hz, density = spectral_density([noise], [noise.after])
    power = float(density.sum()) * frequency_hz[1]
    assert power == pytest.approx(float(noise.after[noise.used].var()), rel=0.1)


def test_filtered_noise_is_white_beyond_the_filter() -> None:
    found = [whiteness([r], [r.after]).probability for r in (residual(seed=seed) for seed in range(12))]
    assert sum(p < 0.05 for p in found) <= 3


def test_correlated_noise_is_not_white() -> None:
    noise = residual()
    slow = lfilter([0.1], [1.0, -0.98], np.random.default_rng(1).normal(size=N))
    found = whiteness([noise], [noise.after + slow])
    assert found.probability < 1e-6
    assert found.correlation[0] > found.bound
    assert found.lags_s[0] == pytest.approx(0.026)


def test_a_zero_residual_is_white() -> None:
    noise = residual()
    assert whiteness([noise], [np.zeros(N)]).probability == 1.0


def test_json_has_the_unit_and_the_method() -> None:
    noise = residual()
    floor = noise_floor([noise], ResidualChannel.FORCE, MASS_KG)
    entry = noise_json(floor, {"after": whiteness([noise], [noise.after])})
    assert entry["unit"] == "N"
    assert entry["rms"] > entry["from_steps"] >= 0.0
    assert 0.0 <= entry["whiteness"]["after"]["probability"] <= 1.0
