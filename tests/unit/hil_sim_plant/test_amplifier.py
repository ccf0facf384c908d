"""Current loop, velocity and position loop of the amplifier."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hil_sim.physics.friction import viscous_friction
from hil_sim.physics.motor import winding
from hil_sim.plant import amplifier

DT_S = 50e-6
WINDING = winding.Params(resistance_v_a=3.0, inductance_h=10e-3)
# Xia et al., equations (2) and (3), with the motor of machines/fuzzy_table
PROPORTIONAL = {"current_bandwidth_hz": 0.0, "current_gain_v_a": 20.0, "peak_current_a": 1e3}
MOTOR = winding.Params(resistance_v_a=1.04, inductance_h=5.27e-3)
DRAG = viscous_friction.Params(1000.0)


def gain_db(bench: Any, hertz: float) -> float:
    axis = bench(1e5, 1e5, winding=WINDING)  # as good as held
    axis.plant.setpoint["loop"] = amplifier.CURRENT
    periods, current, wanted = 20, [], []
    for k in range(round(periods / hertz / DT_S)):
        wanted.append(0.5 * math.sin(2.0 * math.pi * hertz * k * DT_S))
        axis.plant.setpoint["current_a"] = wanted[-1]
        axis.advance()
        current.append(float(axis.state["current_a"]))
    half = len(current) // 2
    return 20.0 * math.log10(np.std(current[half:]) / np.std(wanted[half:]))


def test_current_loop_has_its_bandwidth(bench: Any) -> None:
    assert gain_db(bench, 100.0) == pytest.approx(0.0, abs=0.3)
    assert gain_db(bench, 1000.0) == pytest.approx(-3.0, abs=1.5)
    assert gain_db(bench, 4000.0) < -9.0


def test_current_step_is_first_order_without_overshoot_or_error(bench: Any) -> None:
    axis = bench(1e5, 1e5, winding=WINDING)
    current = axis.record(lambda _: 500.0, 0.01, "current_a")["current_a"]
    assert current.max() < 2.0 * 1.02
    assert current[-1] == pytest.approx(2.0, rel=1e-4)
    assert current[3] == pytest.approx(2.0 * (1.0 - math.exp(-2.0 * math.pi * 1000.0 * 4.0 * DT_S)), rel=0.12)


def test_voltage_limit_bounds_the_slope_of_the_current_and_winds_nothing_up(bench: Any) -> None:
    axis = bench(1e5, 1e5, winding=WINDING, amplifier_with={"voltage_limit_v": 40.0})
    current = axis.record(lambda _: 2000.0, 0.02, "current_a", "voltage_v")
    assert np.diff(current["current_a"]).max() <= 40.0 / WINDING.inductance_h * DT_S
    assert np.abs(current["voltage_v"]).max() <= 40.0
    assert current["current_a"].max() < 8.0 * 1.02
    assert current["current_a"][-1] == pytest.approx(8.0, rel=1e-3)


def test_back_emf_leaves_no_steady_error_of_the_current(bench: Any) -> None:
    axis = bench(20.0, 50.0, winding=WINDING, viscous_friction=viscous_friction.Params(1000.0))
    axis.record(lambda _: 100.0, 1.0, "current_a")
    assert axis.state["motor_velocity_m_s"] == pytest.approx(0.1, rel=1e-2)
    assert axis.state["current_a"] == pytest.approx(100.0 / 250.0, rel=1e-3)
    assert axis.state["voltage_v"] == pytest.approx(3.0 * 0.4 + 250.0 * 0.1, rel=1e-2)


def test_without_a_winding_the_current_is_the_set_point_at_once(bench: Any) -> None:
    axis = bench()
    axis.force(100.0)
    axis.advance()
    assert axis.state["current_a"] == pytest.approx(0.4)


def test_current_is_held_within_the_set_point_s_and_the_amplifier_s_limit(bench: Any) -> None:
    axis = bench()
    axis.force(1e6)
    axis.advance()
    assert axis.state["current_a"] == 10.0
    axis.plant.setpoint["current_limit_a"] = 1.5
    axis.advance()
    assert axis.state["current_a"] == 1.5


def test_velocity_loop_reaches_its_set_point_against_friction(bench: Any) -> None:
    axis = bench(winding=WINDING, viscous_friction=viscous_friction.Params(500.0))
    axis.plant.setpoint["loop"] = amplifier.VELOCITY
    axis.plant.setpoint["velocity_m_s"] = 0.05
    axis.advance(20_000)
    assert axis.state["motor_velocity_m_s"] == pytest.approx(0.05, rel=1e-3)


def test_position_loop_follows_interpolated_set_points_without_a_velocity_ripple(bench: Any) -> None:
    axis = bench(winding=WINDING, viscous_friction=viscous_friction.Params(500.0))
    axis.plant.setpoint["loop"] = amplifier.POSITION
    velocity = []
    for k in range(1000):
        axis.plant.setpoint["position_m"] = 0.02 * (k + 1) * 1e-3
        axis.advance(20)
        velocity.append(float(axis.state["motor_velocity_m_s"]))
    assert axis.state["motor_position_m"] == pytest.approx(0.02, abs=2e-6)
    assert np.ptp(velocity[500:]) < 2e-4


def test_switching_from_force_to_velocity_takes_the_force_over_without_a_bump(bench: Any) -> None:
    axis = bench(viscous_friction=viscous_friction.Params(2000.0))
    axis.record(lambda _: 100.0, 1.0, "current_a")
    axis.plant.setpoint["loop"] = amplifier.VELOCITY
    axis.plant.setpoint["velocity_m_s"] = axis.state["encoder_velocity_m_s"]
    axis.advance()
    assert axis.state["current_a"] == pytest.approx(0.4, rel=5e-3)


def test_power_off_takes_the_current_away_and_starts_afresh(bench: Any) -> None:
    axis = bench(winding=WINDING)
    axis.record(lambda _: 100.0, 0.05, "current_a")
    axis.plant.setpoint["loop"] = amplifier.OFF
    axis.advance()
    for name in ("current_a", "voltage_v", "current_integral_v", "velocity_integral_n"):
        assert axis.state[name] == 0.0


def test_a_long_call_with_a_constant_set_point_equals_many_short_ones(bench: Any) -> None:
    long, short = bench(winding=WINDING), bench(winding=WINDING)
    for axis in (long, short):
        axis.force(77.0)
    long.advance(400)
    for _ in range(20):
        short.advance(20)
    assert long.state.tobytes() == short.state.tobytes()


def test_velocity_estimate_follows_with_its_corner(bench: Any) -> None:
    axis = bench()
    axis.record(lambda _: 70.0, 0.1, "encoder_velocity_m_s")  # 1 m/s^2
    lag_s = (axis.state["motor_velocity_m_s"] - axis.state["encoder_velocity_m_s"]) / 1.0
    assert lag_s == pytest.approx(1.0 / (2.0 * math.pi * 1000.0), rel=0.3)


def test_proportional_current_loop_is_the_closed_form_of_equation_3(bench: Any) -> None:
    """Held: i = Kcp i* / (Kcp + R) (1 - exp(-(Kcp + R) t / L)), with the voltage held over each substep."""
    axis = bench(1e9, 1e9, winding=MOTOR, amplifier_with=PROPORTIONAL)
    current = axis.record(lambda _: 500.0, 0.005, "current_a")["current_a"]
    final = 20.0 * 2.0 / 21.04
    kept = math.exp(-1.04 * DT_S / 5.27e-3)
    steps = np.arange(len(current)) + 1
    assert current == pytest.approx(final * (1.0 - (kept - (1.0 - kept) * 20.0 / 1.04) ** steps), rel=1e-7)
    lag = 1.0 - np.exp(-21.04 / 5.27e-3 * steps * DT_S)
    assert np.abs(current - final * lag).max() < 0.05 * final


def test_back_emf_and_resistance_leave_an_error_of_the_proportional_current_loop(bench: Any) -> None:
    axis = bench(20.0, 50.0, winding=MOTOR, amplifier_with=PROPORTIONAL, viscous_friction=DRAG)
    axis.record(lambda _: 500.0, 2.0, "current_a")
    back_emf_v = 250.0 * float(axis.state["motor_velocity_m_s"])
    assert back_emf_v > 10.0
    assert axis.state["current_a"] == pytest.approx((20.0 * 2.0 - back_emf_v) / 21.04, rel=1e-4)


def test_proportional_current_loop_keeps_the_voltage_limit(bench: Any) -> None:
    axis = bench(1e9, 1e9, winding=MOTOR, amplifier_with=PROPORTIONAL | {"voltage_limit_v": 10.0})
    run = axis.record(lambda _: 500.0, 0.05, "current_a", "voltage_v")
    assert run["voltage_v"].max() == 10.0
    assert np.diff(run["current_a"]).max() <= 10.0 / MOTOR.inductance_h * DT_S
    assert run["current_a"][-1] == pytest.approx(20.0 * 2.0 / 21.04, rel=1e-6)


@pytest.mark.parametrize(("kvp_a_s", "kcp_v_a"), [(0.3, 20.0), (0.9, 8.0)])
def test_velocity_step_agrees_with_equations_2_to_4_in_radians(
    bench: Any, kvp_a_s: float, kcp_v_a: float
) -> None:
    """The paper's units on one side (rad, N m, A s/rad), ours at the table on the other."""
    turn_rad_m = 2.0 * math.pi / 0.01
    kt_nm_a, inertia_kg_m2, speed_rad_s = 250.0 / turn_rad_m, 70.0 / turn_rad_m**2, 100.0

    def motion(_t: float, y: Any) -> list[float]:
        omega, current = y
        volts = kcp_v_a * (kvp_a_s * (speed_rad_s - omega) - current)
        return [kt_nm_a * current / inertia_kg_m2, (volts - kt_nm_a * omega - 1.04 * current) / 5.27e-3]

    axis = bench(
        winding=MOTOR,
        amplifier_with=PROPORTIONAL
        | {
            "current_gain_v_a": kcp_v_a,
            "velocity_gain_n_s_m": kvp_a_s * kt_nm_a * turn_rad_m**2,
            "velocity_integral_n_m": 0.0,
            "velocity_filter_hz": 1e6,
            "voltage_limit_v": 2e3,
        },
    )
    axis.plant.setpoint["current_limit_a"] = 1e3
    axis.plant.setpoint["loop"] = amplifier.VELOCITY
    axis.plant.setpoint["velocity_m_s"] = speed_rad_s / turn_rad_m
    speed = []
    for _ in range(1000):
        axis.advance()
        speed.append(float(axis.state["motor_velocity_m_s"]) * turn_rad_m)
    truth = solve_ivp(motion, (0.0, 0.05), [0.0, 0.0], t_eval=(np.arange(1000) + 1) * DT_S, rtol=1e-8)
    assert truth.y[0].max() > 0.5 * speed_rad_s
    # the voltage is held, and the speed measured, over a substep each
    assert np.abs(np.array(speed) - truth.y[0]).max() < 0.05 * truth.y[0].max()
