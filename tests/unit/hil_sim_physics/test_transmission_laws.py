"""Screw errors, growth, play and coupling against hand calculations."""

import math

import pytest
from temperature_step import temperature_after

from hil_sim.physics.load import constant_force
from hil_sim.physics.transmission import (
    backlash,
    drive_compliance,
    lead_error_cumulative,
    lead_error_periodic,
    thermal_expansion,
)

TURN_RAD_M = 2.0 * math.pi / 0.01
WARM = thermal_expansion.Params(
    expansion_1_k=11.5e-6,
    fixed_end_m=-0.2,
    reference_k=293.15,
    start_k=293.15,
    ambient_k=293.15,
    heat_capacity_j_k=800.0,
    resistance_k_w=2.0,
    heat_share=0.5,
)


def test_cumulative_lead_error_of_20_um_per_m() -> None:
    p = lead_error_cumulative.Params(20e-6)
    assert lead_error_cumulative.error_m(p, 0.3, TURN_RAD_M) == pytest.approx(6e-6)
    assert lead_error_cumulative.slope(p, 0.3, TURN_RAD_M) == 20e-6


def test_periodic_lead_error_peaks_a_quarter_turn_after_its_phase() -> None:
    p = lead_error_periodic.Params(amplitude_m=2e-6, harmonic=1.0, phase_rad=0.0)
    assert lead_error_periodic.error_m(p, 0.0025, TURN_RAD_M) == pytest.approx(2e-6)
    assert lead_error_periodic.error_m(p, 0.0525, TURN_RAD_M) == pytest.approx(2e-6)
    assert lead_error_periodic.slope(p, 0.0, TURN_RAD_M) == pytest.approx(2e-6 * TURN_RAD_M)


def test_screw_grows_away_from_its_fixed_bearing() -> None:
    warm = thermal_expansion.State(303.15)
    assert thermal_expansion.error_m(WARM, warm, 0.1, TURN_RAD_M) == pytest.approx(11.5e-6 * 10.0 * 0.3)
    assert thermal_expansion.error_m(WARM, warm, -0.2, TURN_RAD_M) == 0.0


def test_screw_warms_as_the_closed_form_of_newtons_law_of_cooling() -> None:
    kelvin, dt_s, power_w = 293.15, 0.1, 12.0
    for _ in range(10_000):
        kelvin = temperature_after(thermal_expansion, WARM, kelvin, power_w, dt_s)
    rise = 0.5 * power_w * 2.0 * (1.0 - math.exp(-1000.0 / (2.0 * 800.0)))
    assert kelvin == pytest.approx(293.15 + rise, abs=1e-3)


def test_play_takes_its_half_width_from_the_gap() -> None:
    p = backlash.Params(2e-6)
    assert backlash.deflection_m(p, 5e-6) == pytest.approx(3e-6)
    assert backlash.deflection_m(p, -5e-6) == pytest.approx(-3e-6)
    assert backlash.deflection_m(p, 1.9e-6) == 0.0


def test_contact_with_play_pushes_and_never_pulls() -> None:
    p = backlash.Params(2e-6)
    assert backlash.contact_force_n(p, 10.0, 1e-6) == 10.0
    assert backlash.contact_force_n(p, -10.0, 1e-6) == 0.0
    assert backlash.contact_force_n(p, -10.0, -1e-6) == -10.0


def test_screw_of_equation_5_in_linear_units() -> None:
    """Xia et al., table II: 0.4 MN/m."""
    p = drive_compliance.Params(0.4e6, 100.0)
    assert drive_compliance.force_n(p, 50e-6, 0.0) == pytest.approx(20.0)
    assert drive_compliance.force_n(p, 0.0, 0.01) == pytest.approx(1.0)


def test_constant_force_is_constant() -> None:
    assert constant_force.force_n(constant_force.Params(-98.1), 0.1, TURN_RAD_M) == -98.1
