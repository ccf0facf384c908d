"""What each effect between current and force leaves in the measured force, and what distinguishes it.

The force is that of the reported current; the residual is this force less mass times acceleration.
"""

import math
from typing import Any

import numpy as np
import pytest

from hil_sim.physics.friction import coulomb_friction, viscous_friction
from hil_sim.physics.load import constant_force, payload_mass
from hil_sim.physics.motor import (
    amplifier_dead_zone,
    cogging,
    current_loop_lag,
    torque_constant_saturation,
    torque_ripple,
    transport_delay,
    voltage_saturation,
    winding,
)

DT_S = 50e-6
LEAD_M, FORCE_CONSTANT_N_A, MASS_KG = 0.01, 250.0, 70.0
HARMONIC, PHASE_RAD = 6.0, 0.4
ONE_WAVE = ((HARMONIC,) + (1.0,) * 5, (PHASE_RAD,) + (0.0,) * 5)


def wave_over_position(run: Any) -> complex:
    """Amplitude and phase of what repeats HARMONIC times a turn in the residual over the position."""
    before_m = run.position_m - DT_S * run.velocity_m_s  # where the forces of the substep were taken
    turn = HARMONIC * 2.0 * math.pi * before_m / LEAD_M
    columns = np.column_stack((np.sin(turn), np.cos(turn), np.ones_like(turn), run.velocity_m_s))
    sine, cosine, *_ = np.linalg.lstsq(columns, run.residual_n, rcond=None)[0]
    return complex(sine, cosine)


def waves(bench: Any, **effects: Any) -> list[complex]:
    """At two speeds, and under a load."""
    found = []
    for speed, load_n in ((0.05, 0.0), (0.2, 0.0), (0.05, -300.0)):
        drag = viscous_friction.Params(400.0)
        axis = bench(viscous_friction=drag, constant_force=constant_force.Params(load_n), **effects)
        force_n = 400.0 * speed - load_n
        axis.force(force_n)
        axis.advance(40_000)
        found.append(wave_over_position(axis.observe(0.02 / speed, force=lambda _, f=force_n: f)))
    return found


def test_cogging_is_fixed_in_space_whatever_speed_and_current(bench: Any) -> None:
    harmonic, phase_rad = ONE_WAVE
    for wave in waves(bench, cogging=cogging.Params(harmonic, (2.0,) + (0.0,) * 5, phase_rad)):
        assert wave == pytest.approx(-2.0 * np.exp(1j * PHASE_RAD), rel=0.01)


def test_torque_ripple_scales_with_the_force(bench: Any) -> None:
    harmonic, phase_rad = ONE_WAVE
    ripple = torque_ripple.Params(harmonic, (0.02,) + (0.0,) * 5, phase_rad)
    for wave, force_n in zip(waves(bench, torque_ripple=ripple), (20.0, 80.0, 320.0), strict=True):
        assert wave == pytest.approx(-0.02 * force_n * np.exp(1j * PHASE_RAD), rel=0.03)


def test_torque_constant_saturation_loses_force_at_the_peak_and_payload_in_every_acceleration(
    bench: Any,
) -> None:
    saturated = {"torque_constant_saturation": torque_constant_saturation.Params(8.0)}
    loaded = {"payload_mass": payload_mass.Params(7.0)}

    def lost(effect: dict[str, Any], force_n: float) -> float:
        run = bench(**effect).observe(0.01, force=lambda _: force_n)
        return float(run.residual_n[-1] / force_n)

    for amperes in (0.5, 4.0, 8.0):
        share = 1.0 - 1.0 / math.sqrt(1.0 + (amperes / 8.0) ** 2)
        assert lost(saturated, 250.0 * amperes) == pytest.approx(share, abs=1e-9)
        assert lost(loaded, 250.0 * amperes) == pytest.approx(7.0 / 77.0)

    # held at rest, or moved slowly, under a load: 1500 N need more than 6 A by saturation alone
    hung = {"constant_force": constant_force.Params(-1500.0)}
    needed = []
    for effect in (saturated, loaded):
        run = bench(**hung, **effect).observe(1.0, velocity=lambda _: 0.0)
        needed.append(run.residual_n[-1])
    assert needed[0] == pytest.approx(1500.0 / math.sqrt(1.0 - (6.0 / 8.0) ** 2), rel=1e-3)
    assert needed[1] == pytest.approx(1500.0, rel=1e-3)


def test_current_loop_lag_leaves_the_slope_of_the_force(bench: Any) -> None:
    tau_s, w = 1.5e-3, 2.0 * math.pi * 8.0
    axis = bench(current_loop_lag=current_loop_lag.Params(tau_s))
    run = axis.observe(0.5, force=lambda t: 400.0 * math.sin(w * t))
    late = run.where(run.time_s > 10.0 * tau_s)
    acting_slope_n_s = np.gradient(late.force_n - late.residual_n, DT_S)
    assert late.residual_n[1:-1] == pytest.approx(
        tau_s * acting_slope_n_s[1:-1], abs=0.03 * 400.0 * tau_s * w
    )


def test_current_loop_lag_answers_a_jump_at_once_and_slowly_transport_delay_late_and_sharply(
    bench: Any,
) -> None:
    jump_n, time_s = 100.0, 2e-3
    lagging = bench(current_loop_lag=current_loop_lag.Params(time_s)).observe(0.01, force=lambda _: jump_n)
    assert lagging.residual_n == pytest.approx(jump_n * np.exp(-lagging.time_s / time_s), abs=1e-6)
    late = bench(transport_delay=transport_delay.Params(time_s)).observe(0.01, force=lambda _: jump_n)
    assert late.residual_n == pytest.approx(
        np.where(late.time_s < time_s + 0.5 * DT_S, jump_n, 0.0), abs=1e-6
    )


def test_transport_delay_leaves_peaks_at_the_edges_of_the_force(bench: Any) -> None:
    """A trapezoid of force: nothing where it is constant, tau times its slope on the ramps."""
    tau_s, slope_n_s = 3e-3, 4000.0

    def trapezoid(t: float) -> float:
        return slope_n_s * min(max(0.0, t - 0.05), 0.05, max(0.0, 0.25 - t))

    run = bench(transport_delay=transport_delay.Params(tau_s)).observe(0.3, force=trapezoid)
    flat = np.array([trapezoid(t) == trapezoid(t - tau_s - DT_S) for t in run.time_s])
    rising = (run.time_s > 0.05 + tau_s) & (run.time_s < 0.1)
    assert np.abs(run.residual_n[flat]).max() < 1e-6
    assert run.residual_n[rising] == pytest.approx(slope_n_s * tau_s, rel=1e-6)


def test_delay_of_no_whole_substeps_is_rounded_and_outlives_the_set_points_of_a_call(bench: Any) -> None:
    axis = bench(transport_delay=transport_delay.Params(1.51e-3))
    axis.force(70.0)
    axis.advance(20)
    axis.force(0.0)
    axis.advance(20)
    axis.advance(400)
    assert axis.state["motor_velocity_m_s"] == pytest.approx(70.0 * 20 * DT_S / MASS_KG)
    one_call = bench(transport_delay=transport_delay.Params(1.51e-3))
    one_call.force(70.0)
    one_call.advance(60)
    assert one_call.state["motor_velocity_m_s"] == pytest.approx(70.0 * 30 * DT_S / MASS_KG)


def test_amplifier_dead_zone_changes_over_at_zero_force_and_coulomb_friction_at_zero_speed(
    bench: Any,
) -> None:
    threshold_n = 15.0
    dead = bench(amplifier_dead_zone=amplifier_dead_zone.Params(threshold_n / FORCE_CONSTANT_N_A))
    dead.observe(0.1, force=lambda _: 150.0)  # moving fast enough not to turn round
    run = dead.observe(0.4, force=lambda t: 60.0 * math.sin(2.0 * math.pi * 10.0 * t))
    assert run.velocity_m_s.min() > 0.05
    assert run.residual_n == pytest.approx(np.clip(run.force_n, -threshold_n, threshold_n), abs=1e-6)
    rubbing = bench(coulomb_friction=coulomb_friction.Params(threshold_n))
    rubbing.observe(0.1, force=lambda _: 165.0)
    run = rubbing.observe(0.3, force=lambda t: 60.0 * math.sin(2.0 * math.pi * 10.0 * t))
    assert run.velocity_m_s.min() > 0.05
    assert run.residual_n == pytest.approx(threshold_n, abs=1e-6)


def test_voltage_saturation_shows_at_high_speed_times_force_and_torque_saturation_at_rest_too(
    bench: Any,
) -> None:
    limit_v, ohm = 100.0, 3.0
    starved = {"voltage_saturation": voltage_saturation.Params(limit_v, ohm)}
    run = bench(**starved).observe(0.06, force=lambda _: 2500.0)
    left_v = limit_v - FORCE_CONSTANT_N_A * np.concatenate(([0.0], run.velocity_m_s[:-1]))
    possible_n = FORCE_CONSTANT_N_A * np.minimum(10.0, left_v / ohm)
    assert run.residual_n == pytest.approx(2500.0 - possible_n, abs=1e-6)
    slow = run.velocity_m_s < 0.9 * (limit_v - 10.0 * ohm) / FORCE_CONSTANT_N_A
    assert np.abs(run.residual_n[slow]).max() < 1e-6
    assert run.residual_n[-1] > 1000.0
    saturated = bench(torque_constant_saturation=torque_constant_saturation.Params(8.0))
    assert saturated.observe(0.001, force=lambda _: 2500.0).residual_n[0] > 500.0


def test_winding_with_its_voltage_limit_starves_alike(bench: Any) -> None:
    """The limit of a winding is the same in the end; there the reported current falls with it."""
    ohm = 3.0
    drag = {"viscous_friction": viscous_friction.Params(2000.0)}
    ideal = bench(**drag, voltage_saturation=voltage_saturation.Params(100.0, ohm))
    wound = bench(**drag, winding=winding.Params(ohm, 1e-3), amplifier_with={"voltage_limit_v": 100.0})
    speeds = []
    for axis in (ideal, wound):
        axis.force(2500.0)
        axis.advance(20_000)
        speeds.append(float(axis.state["motor_velocity_m_s"]))
    assert speeds[0] == pytest.approx(speeds[1], rel=1e-3)
    assert wound.state["current_a"] < 0.3 * ideal.state["current_a"]
