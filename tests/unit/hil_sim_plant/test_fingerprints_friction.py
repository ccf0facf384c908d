"""The image of each friction effect in the measured force, and its difference from look-alikes."""

import math
from typing import Any

import numpy as np
import pytest

from hil_sim.physics.friction import (
    asymmetric_coulomb_friction,
    asymmetric_viscous_friction,
    coulomb_friction,
    dwell_dependent_breakaway,
    friction_ageing,
    load_dependent_friction,
    position_dependent_friction,
    presliding_hysteresis,
    quadratic_viscous_friction,
    stribeck_friction,
    temperature_dependent_friction,
    viscous_friction,
)
from hil_sim.physics.load import constant_force, position_dependent_force
from hil_sim.physics.transmission import backlash, drive_compliance
from hil_sim.plant import amplifier

COULOMB_N, VISCOUS_N_S_M = 20.0, 100.0
PLAIN: dict[str, Any] = {
    "coulomb_friction": coulomb_friction.Params(COULOMB_N),
    "viscous_friction": viscous_friction.Params(VISCOUS_N_S_M),
}
SPEEDS_M_S = np.array([0.02, 0.05, 0.1, 0.2])


def left_over(bench: Any, speeds_m_s: Any, **effects: Any) -> tuple[Any, Any]:
    """Velocity, and force (N) that Coulomb and viscous friction do not explain, both ways (2, n)."""
    axis = bench(**PLAIN, **effects)
    velocity, needed = axis.at_speeds(np.concatenate([speeds_m_s, -speeds_m_s]))
    rest = needed - COULOMB_N * np.sign(velocity) - VISCOUS_N_S_M * velocity
    return velocity.reshape(2, -1), rest.reshape(2, -1)


def breakaway_n(bench: Any, rest_s: float, direction: float, **effects: Any) -> float:
    """Force (N) at which the axis sets off after a move and a rest."""
    axis = bench(**PLAIN, **effects)
    axis.observe(0.1, velocity=lambda t: 0.05 if t < 0.05 else 0.0)
    axis.force(0.0)
    axis.advance(round(rest_s / 50e-6))
    run = axis.observe(0.4, force=lambda t: direction * 100.0 * t)
    return float(run.force_n[np.flatnonzero(run.velocity_m_s)[0]])


def test_asymmetric_coulomb_friction_is_even_while_moving_and_breaks_away_alike(bench: Any) -> None:
    shifted = {"constant_force": constant_force.Params(-4.0)}
    sided = {"asymmetric_coulomb_friction": asymmetric_coulomb_friction.Params(4.0)}
    for effect in (sided, shifted):
        assert left_over(bench, SPEEDS_M_S, **effect)[1] == pytest.approx(np.full((2, 4), 4.0), abs=0.01)
    assert breakaway_n(bench, 0.1, 1.0, **sided) == pytest.approx(24.0, abs=0.05)
    assert breakaway_n(bench, 0.1, -1.0, **sided) == pytest.approx(-24.0, abs=0.05)
    assert breakaway_n(bench, 0.1, 1.0, **shifted) == pytest.approx(24.0, abs=0.05)
    assert breakaway_n(bench, 0.1, -1.0, **shifted) == pytest.approx(-16.0, abs=0.05)


def test_asymmetric_viscous_friction_has_a_slope_for_each_direction(bench: Any) -> None:
    velocity, sloped = left_over(
        bench, SPEEDS_M_S, asymmetric_viscous_friction=asymmetric_viscous_friction.Params(30.0)
    )
    assert sloped == pytest.approx(30.0 * np.abs(velocity), abs=0.01)
    _, stepped = left_over(
        bench, SPEEDS_M_S, asymmetric_coulomb_friction=asymmetric_coulomb_friction.Params(4.0)
    )
    assert np.ptp(stepped) < 0.1


@pytest.mark.parametrize(("force_n", "way"), [(400.0, 1.0), (200.0, -1.0)])
def test_load_dependent_friction_is_a_share_of_the_load_without_or_with_friction(
    bench: Any, force_n: float, way: float
) -> None:
    """A constant force lifts or lowers a weight; at the final speed nothing accelerates."""
    share, weight_n, viscous_n_s_m = 0.1, 300.0, 1000.0
    for friction_share, load_n in ((0.0, weight_n), (1.0, force_n)):
        axis = bench(
            coulomb_friction=coulomb_friction.Params(COULOMB_N),
            viscous_friction=viscous_friction.Params(viscous_n_s_m),
            constant_force=constant_force.Params(-weight_n),
            load_dependent_friction=load_dependent_friction.Params(share, friction_share),
        )
        axis.force(force_n)
        axis.advance(40_000)
        expected_m_s = (force_n - weight_n - way * (COULOMB_N + share * load_n)) / viscous_n_s_m
        assert axis.state["motor_velocity_m_s"] == pytest.approx(expected_m_s, rel=1e-6)


def test_stribeck_friction_is_an_odd_bump_at_slow_constant_speeds(bench: Any) -> None:
    slow_m_s = np.array([0.001, 0.003, 0.006, 0.05])
    velocity, bump = left_over(bench, slow_m_s, stribeck_friction=stribeck_friction.Params(6.0, 0.004))
    expected = 6.0 * np.sign(velocity) * np.exp(-((velocity / 0.004) ** 2))
    assert bump == pytest.approx(expected, abs=0.02)
    assert bump[0, 0] > 5.0
    _, loop = left_over(bench, slow_m_s, presliding_hysteresis=presliding_hysteresis.Params(6.0, 1e-6))
    assert loop == pytest.approx(np.array([[6.0] * 4, [-6.0] * 4]), abs=0.05)


def test_quadratic_viscous_friction_grows_fourfold_with_twice_the_speed(bench: Any) -> None:
    drag = {"quadratic_viscous_friction": quadratic_viscous_friction.Params(250.0)}
    velocity, curve = left_over(bench, np.array([0.1, 0.2]), **drag)
    assert curve == pytest.approx(250.0 * velocity * np.abs(velocity), abs=0.01)
    assert curve[:, 1] / curve[:, 0] == pytest.approx(4.0, rel=0.05)


@pytest.mark.parametrize("hertz", [1.5, 6.0])
def test_presliding_hysteresis_is_a_loop_over_the_travel_since_the_reversal(bench: Any, hertz: float) -> None:
    """The same curve at any speed; and no step between scale and encoder, as play would leave."""
    level_n, way_m, stroke_m = 8.0, 5e-6, 4e-4
    axis = bench(**PLAIN, presliding_hysteresis=presliding_hysteresis.Params(level_n, way_m))
    w = 2.0 * math.pi * hertz
    run = axis.observe(0.95 / hertz, velocity=lambda t: stroke_m * w * math.cos(w * t))
    back = run.where((run.time_s > 0.25 / hertz) & (run.velocity_m_s < 0.0))
    way = run.position_m.max() - back.position_m
    friction_n = back.residual_n - VISCOUS_N_S_M * back.velocity_m_s + COULOMB_N
    assert friction_n == pytest.approx(level_n * (2.0 * np.exp(-way / way_m) - 1.0), abs=0.25)
    assert np.ptp(run.deviation_m) < 20e-9


def test_backlash_is_no_loop_in_the_force_of_the_motor_but_a_step_of_scale_less_encoder(bench: Any) -> None:
    stiff = drive_compliance.Params(3e8, 2e4)
    axis = bench(**PLAIN, drive_compliance=stiff, backlash=backlash.Params(3e-6))
    run = axis.observe(0.5, velocity=lambda t: 0.01 if t < 0.25 else -0.01)
    there, back = run.deviation_m[4000:4900].mean(), run.deviation_m[9000:].mean()
    assert back - there == pytest.approx(6e-6, abs=0.3e-6)


def test_dwell_dependent_breakaway_grows_with_the_dwell_alone(bench: Any) -> None:
    rests_s = np.array([0.1, 0.5, 3.0])
    aged = {"dwell_dependent_breakaway": dwell_dependent_breakaway.Params(6.0, 0.5, 10e-6)}
    peaks = [breakaway_n(bench, rest, 1.0, **aged) for rest in rests_s]
    ramp_s = np.array(peaks) / 100.0  # it is at rest during the ramp too
    assert np.array(peaks) == pytest.approx(COULOMB_N + 6.0 * -np.expm1(-(rests_s + ramp_s) / 0.5), abs=0.7)
    assert peaks[0] < peaks[1] - 1.0 < peaks[2] - 2.0
    bump = {"stribeck_friction": stribeck_friction.Params(6.0, 0.004)}
    assert np.ptp([breakaway_n(bench, rest, 1.0, **bump) for rest in rests_s]) < 0.05


def test_position_dependent_friction_flips_its_sign_and_position_dependent_force_does_not(bench: Any) -> None:
    shape = {"centre_m": 5e-3, "half_travel_m": 5e-3, "power_1_n": 5.0, "power_2_n": -2.0, "power_3_n": 1.0}
    rubbing = {"position_dependent_friction": position_dependent_friction.Params(**shape)}
    pushing = {"position_dependent_force": position_dependent_force.Params(**shape)}
    places_m = np.linspace(1e-3, 9e-3, 9)
    u = (places_m - 5e-3) / 5e-3
    expected = 5.0 * u - 2.0 * u**2 + u**3
    for effect, odd, even in ((rubbing, expected, 0.0 * u), (pushing, 0.0 * u, -expected)):
        axis = bench(**PLAIN, **effect)
        ways = []
        for speed in (0.05, -0.05):
            run = axis.observe(0.25, velocity=lambda _, v=speed: v)
            steady = run.where(np.abs(run.velocity_m_s - speed) < 0.02)
            friction_n = steady.residual_n - VISCOUS_N_S_M * steady.velocity_m_s
            order = np.argsort(steady.position_m)
            ways.append(np.interp(places_m, steady.position_m[order], friction_n[order]))
        forwards, backwards = ways[0] - COULOMB_N, ways[1] + COULOMB_N
        assert 0.5 * (forwards - backwards) == pytest.approx(odd, abs=0.02)
        assert 0.5 * (forwards + backwards) == pytest.approx(even, abs=0.02)


def test_ripple_of_friction_repeats_over_its_length() -> None:
    p = position_dependent_friction.Params(0.0, 0.1, wave_n=2.0, wave_length_m=4e-3, wave_phase_rad=0.5)
    for place_m in (0.0, 1e-3, 0.3):
        level = position_dependent_friction.level_n(p, place_m)
        assert level == pytest.approx(2.0 * math.sin(2.0 * math.pi * place_m / 4e-3 + 0.5))


def test_temperature_dependent_friction_drifts_and_comes_back_after_cooling(bench: Any) -> None:
    """Wear does not."""
    warming = temperature_dependent_friction.Params(0.5, 1.0, 0.5, 1.0, 1.0)
    wear = friction_ageing.Params(-0.2, 0.0)
    left = {}
    for name, effect in (("temperature_dependent_friction", warming), ("friction_ageing", wear)):
        axis = bench(**PLAIN, **{name: effect})
        levels_n = []
        for loop, seconds in ((amplifier.VELOCITY, 3.0), (amplifier.OFF, 10.0), (amplifier.OFF, 0.0)):
            (velocity,), (needed_n,) = axis.at_speeds([0.05])
            levels_n.append(needed_n - VISCOUS_N_S_M * velocity)
            axis.plant.setpoint["loop"] = loop
            axis.advance(round(seconds / 50e-6))
        cold_n, warm_n, rested_n = levels_n
        assert warm_n < cold_n - 0.5
        left[name] = (cold_n - rested_n) / (cold_n - warm_n)
    assert left["temperature_dependent_friction"] < 0.05
    assert left["friction_ageing"] > 0.95
