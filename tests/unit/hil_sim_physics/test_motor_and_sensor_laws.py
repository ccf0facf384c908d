"""Winding, cogging, encoder and scale against closed forms."""

import math

import numpy as np
import pytest

from hil_sim.physics.motor import cogging, winding
from hil_sim.physics.sensor import encoder, scale

# Xia et al., table II
RESISTANCE_OHM, INDUCTANCE_H = 1.04, 52.7e-3


def test_current_rises_as_the_closed_form_of_equation_1() -> None:
    p = winding.Params(RESISTANCE_OHM, INDUCTANCE_H)
    current, dt_s = 0.0, 50e-6
    for _ in range(1000):
        current = winding.current_a(p, current, 24.0, 4.0, winding.decay(p, dt_s))
    expected = 20.0 / RESISTANCE_OHM * (1.0 - math.exp(-RESISTANCE_OHM * 0.05 / INDUCTANCE_H))
    assert current == pytest.approx(expected, rel=1e-12)


def test_one_long_step_equals_many_short_ones() -> None:
    p = winding.Params(RESISTANCE_OHM, INDUCTANCE_H)
    many = 3.0
    for _ in range(64):
        many = winding.current_a(p, many, -10.0, 1.0, winding.decay(p, 1e-3))
    assert winding.current_a(p, 3.0, -10.0, 1.0, winding.decay(p, 64e-3)) == pytest.approx(many, rel=1e-12)


def test_cogging_has_the_fourier_coefficients_of_its_parameters() -> None:
    p = cogging.Params((7.0, 28.0, 14.0, 0.0, 0.0, 0.0), (1.5, 0.25, -0.5, 0.0, 0.0, 0.0), (0.3,) * 6)
    lead_m, samples = 0.01, 256
    position = np.arange(samples) * lead_m / samples
    force = np.array([cogging.force_n(p, x, 2.0 * math.pi / lead_m) for x in position])
    spectrum = 2.0 * np.fft.rfft(force) / samples  # A sin(n phi + p) -> -i A exp(i p)
    for n, amplitude in ((7, 1.5), (28, 0.25), (14, -0.5)):
        assert spectrum[n] == pytest.approx(-1j * amplitude * np.exp(0.3j), abs=1e-12)
    assert np.sum(np.abs(spectrum)) == pytest.approx(2.25)


@pytest.mark.parametrize(
    ("position_m", "count"), [(0.0, 0), (0.24e-6, 0), (0.26e-6, 1), (-0.26e-6, -1), (0.1, 200_000)]
)
def test_scale_of_half_a_micrometre_reads_the_nearest_count(position_m: float, count: int) -> None:
    assert scale.counts(scale.Params(0.5e-6, 0.0), position_m) == count


def test_encoder_of_20_bits_reads_a_turn_of_10_mm() -> None:
    p = encoder.Params(0.01 / 2**20, 0.0)
    assert encoder.counts(p, 0.01) == 2**20
    assert encoder.counts(p, -0.025) == -5 * 2**19
