"""The image of each effect between motor and scale in their deviation, and how they are distinguished."""

import math
from typing import Any

import numpy as np
import pytest

from hil_sim.physics.friction import coulomb_friction, viscous_friction
from hil_sim.physics.sensor import encoder_eccentricity, scale_cyclic_error
from hil_sim.physics.transmission import (
    backlash,
    drive_compliance,
    lead_error_cumulative,
    lead_error_periodic,
    thermal_expansion,
)

LEAD_M = 0.01
TURN_RAD_M = 2.0 * math.pi / LEAD_M
STIFF = drive_compliance.Params(3e8, 2e4)
NOISE_M = 12e-9  # counts of encoder and scale


def lost_um(bench: Any, friction_n: float, **effects: Any) -> float:
    """Step (um) of scale less encoder at a reversal of 10 mm/s under a friction."""
    axis = bench(coulomb_friction=coulomb_friction.Params(friction_n), **effects)
    run = axis.observe(0.5, velocity=lambda t: 0.01 if t < 0.25 else -0.01)
    return float(run.deviation_m[9000:].mean() - run.deviation_m[4000:4900].mean()) * 1e6


def test_backlash_is_a_step_whatever_the_force_and_drive_compliance_in_proportion_to_it(bench: Any) -> None:
    for friction_n in (20.0, 80.0):
        play = lost_um(bench, friction_n, drive_compliance=STIFF, backlash=backlash.Params(3e-6))
        assert play == pytest.approx(6.0 + 2.0 * friction_n / 3e8 * 1e6, abs=0.15)
        wound_up = lost_um(bench, friction_n, drive_compliance=drive_compliance.Params(2e7, 5e3))
        assert wound_up == pytest.approx(2.0 * friction_n / 2e7 * 1e6, abs=0.15)


def test_drive_compliance_is_a_slope_over_the_transmitted_force_and_backlash_a_step(bench: Any) -> None:
    spring = drive_compliance.Params(2e7, 5e3)
    drag = {"viscous_friction": viscous_friction.Params(2000.0)}

    def wind_up(**effects: Any) -> tuple[Any, Any]:
        run = bench(**drag, **effects).observe(0.5, force=lambda t: 120.0 * math.sin(2.0 * math.pi * 4.0 * t))
        transmitted_n = run.force_n - 20.0 * np.gradient(run.velocity_m_s, 50e-6)
        return transmitted_n[2000:], run.deviation_m[2000:]

    transmitted_n, deviation_m = wind_up(drive_compliance=spring)
    slope = np.polyfit(transmitted_n, deviation_m, 1)
    assert slope[0] == pytest.approx(-1.0 / 2e7, rel=0.02)
    assert np.abs(deviation_m - np.polyval(slope, transmitted_n)).max() < 0.1e-6
    transmitted_n, deviation_m = wind_up(drive_compliance=STIFF, backlash=backlash.Params(5e-6))
    strong = np.abs(transmitted_n) > 60.0
    beyond_m = np.abs(deviation_m + 5e-6 * np.sign(transmitted_n))[strong]
    assert np.quantile(beyond_m, 0.98) < 0.6e-6  # but for the impacts


def there_and_back(axis: Any, half_s: float = 0.5) -> Any:
    return axis.observe(2.0 * half_s, velocity=lambda t: 0.1 if t < half_s else -0.1)


def test_lead_error_cumulative_grows_with_the_position_alike_both_ways_and_warm(bench: Any) -> None:
    cumulative = {"lead_error_cumulative": lead_error_cumulative.Params(60e-6)}
    axis = bench(viscous_friction=viscous_friction.Params(500.0), **cumulative)
    for _ in range(2):
        run = there_and_back(axis)
        assert run.deviation_m == pytest.approx(60e-6 * run.position_m, abs=NOISE_M)


def test_thermal_expansion_drifts_in_proportion_to_the_distance_from_the_fixed_end(bench: Any) -> None:
    growth = thermal_expansion.Params(11.5e-6, 0.0, 293.15, 293.15, 293.15, 1.0, 5.0, 1.0)
    axis = bench(viscous_friction=viscous_friction.Params(500.0), thermal_expansion=growth)
    slopes = []
    for _ in range(3):
        run = there_and_back(axis)
        late = run.where(run.time_s > 0.9)  # little of the warming lies within a tenth of a second
        slopes.append(np.polyfit(late.position_m, late.deviation_m, 1)[0])
        assert axis.state["thermal_expansion"]["temperature_k"] > 293.15 + 2.0
    assert slopes[0] > 11.5e-6
    assert slopes[0] < slopes[1] < slopes[2]
    late_m = 11.5e-6 * (axis.state["thermal_expansion"]["temperature_k"] - 293.15) * run.position_m[-1]
    assert run.deviation_m[-1] == pytest.approx(late_m, abs=NOISE_M)


def test_lead_error_periodic_and_encoder_eccentricity_are_one_class_without_a_third_sensor(
    bench: Any,
) -> None:
    """Once a turn in both. They differ in where the motor really is: here the state, there a third sensor."""
    wobbling = bench(lead_error_periodic=lead_error_periodic.Params(3e-6, 1.0, 0.7))
    eccentric = bench(encoder_eccentricity=encoder_eccentricity.Params(-3e-6, 0.7))
    for axis, encoder_m in ((wobbling, 0.0), (eccentric, -3e-6)):
        start_m = 3e-6 * math.sin(0.7)  # both sensors read nothing at power-up
        run = axis.observe(0.3, velocity=lambda _: 0.1)
        expected = 3e-6 * np.sin(TURN_RAD_M * run.position_m + 0.7) - start_m
        assert run.deviation_m == pytest.approx(expected, abs=NOISE_M)
        shown_m = LEAD_M / 2**20 * float(axis.state["encoder_counts"])
        error_m = encoder_m * (math.sin(TURN_RAD_M * run.position_m[-1] + 0.7) - math.sin(0.7))
        assert shown_m - run.position_m[-1] == pytest.approx(error_m, abs=NOISE_M)


def test_encoder_eccentricity_lets_a_loop_on_the_encoder_turn_unevenly(bench: Any) -> None:
    speeds = {}
    for name, effect in (
        ("encoder", {"encoder_eccentricity": encoder_eccentricity.Params(20e-6, 0.0)}),
        ("screw", {"lead_error_periodic": lead_error_periodic.Params(-20e-6, 1.0, 0.0)}),
    ):
        run = bench(**effect).observe(1.0, velocity=lambda _: 0.01)
        speeds[name] = float(np.ptp(run.velocity_m_s[10_000:]))
    assert speeds["encoder"] == pytest.approx(2.0 * 20e-6 * TURN_RAD_M * 0.01, rel=0.3)
    assert speeds["screw"] < 0.3 * speeds["encoder"]


def test_scale_cyclic_error_has_a_force_image_that_grows_with_the_square_of_the_speed(bench: Any) -> None:
    """Mass times the second derivative of the reading; the motor's force knows nothing of it."""
    period_m, amplitude_m = 400e-6, 0.5e-6
    cyclic = {"scale_cyclic_error": scale_cyclic_error.Params(amplitude_m, period_m, 0.3)}
    images = []
    for speed in (0.02, 0.04):
        axis = bench(**cyclic)
        axis.observe(0.3, velocity=lambda _, v=speed: v)
        run = axis.observe(5.0 * period_m / speed, velocity=lambda _, v=speed: v)
        reading_m = (run.deviation_m + run.position_m)[::20]
        image_n = 70.0 * np.diff(reading_m, 2) / 1e-6
        angle = 2.0 * math.pi / period_m * run.position_m[20:-20:20][: len(image_n)]
        columns = np.column_stack((np.sin(angle), np.cos(angle), np.ones_like(angle)))
        images.append(float(np.hypot(*np.linalg.lstsq(columns, image_n, rcond=None)[0][:2])))
        expected = amplitude_m * np.sin(2.0 * math.pi / period_m * run.position_m + 0.3)
        assert run.deviation_m == pytest.approx(expected - amplitude_m * math.sin(0.3), abs=NOISE_M)
        assert np.abs(run.residual_n).max() < 1e-6
    assert images[1] / images[0] == pytest.approx(4.0, rel=0.1)
    assert images[0] == pytest.approx(70.0 * amplitude_m * (2.0 * math.pi * 0.02 / period_m) ** 2, rel=0.1)
