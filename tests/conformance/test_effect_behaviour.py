"""Requirements on every effect of a kind, over random inputs within bounds; friction has a separate file."""

import math
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from effect_draws import DT_S, FEW, POSITION_M, of_kind, own_state, parameters
from hypothesis import given
from hypothesis import strategies as st

from hil_sim.physics.kinds import Kind

TURN_RAD_M = st.floats(1.0, 1e5)


@of_kind(Kind.MOTOR_FORCE, Kind.TABLE_FORCE)
@FEW
@given(data=st.data(), position=POSITION_M, turn=TURN_RAD_M)
def test_force_is_finite(effect: ModuleType, data: Any, position: float, turn: float) -> None:
    assert math.isfinite(effect.force_n(data.draw(parameters(effect)), position, turn))


@of_kind(Kind.STATE_FORCE)
@FEW
@given(data=st.data(), position=POSITION_M, velocity=st.floats(-10.0, 10.0))
def test_force_of_the_state_is_within_the_values_of_its_points(
    effect: ModuleType, data: Any, position: float, velocity: float
) -> None:
    p = data.draw(parameters(effect))
    force = effect.force_n(p, position, velocity)
    assert min(p.force_n) - 1e-9 <= force <= max(p.force_n) + 1e-9


@of_kind(Kind.FORCE_IN_TIME)
@FEW
@given(data=st.data(), time_s=st.floats(0.0, 1e5))
def test_force_in_time_is_finite(effect: ModuleType, data: Any, time_s: float) -> None:
    assert math.isfinite(effect.force_n(data.draw(parameters(effect)), time_s))


@of_kind(Kind.FORCE_RIPPLE)
@FEW
@given(data=st.data(), position=POSITION_M, turn=TURN_RAD_M)
def test_ripple_of_the_force_repeats_every_turn(
    effect: ModuleType, data: Any, position: float, turn: float
) -> None:
    p = data.draw(parameters(effect))
    p = p._replace(harmonic=tuple(round(order) % 50 for order in p.harmonic))
    ripple = effect.relative_ripple(p, position, turn)
    assert math.isfinite(ripple)
    assert ripple == pytest.approx(effect.relative_ripple(p, position + 2.0 * math.pi / turn, turn), abs=1e-5)


@of_kind(Kind.CURRENT_PATH)
@FEW
@given(
    data=st.data(),
    currents=st.lists(st.floats(-50.0, 50.0), min_size=1, max_size=30),
    emf=st.floats(-20.0, 20.0),
)
def test_no_more_current_flows_than_commanded_or_driven_by_the_back_emf(
    effect: ModuleType, data: Any, currents: list[float], emf: float
) -> None:
    p, s = data.draw(parameters(effect)), own_state(effect)
    asked = max(abs(current) for current in currents)
    driven = abs(emf) / p.resistance_v_a if "resistance_v_a" in p._fields else 0.0
    for current in currents:
        passed = effect.force_producing_a(p, *s, current, emf, DT_S)
        assert abs(passed) <= max(asked, driven) * (1.0 + 1e-12)


@of_kind(Kind.MASS)
@FEW
@given(data=st.data())
def test_added_mass_is_never_negative(effect: ModuleType, data: Any) -> None:
    mass = effect.added_kg(data.draw(parameters(effect)))
    assert math.isfinite(mass)
    assert mass >= 0.0


@of_kind(Kind.ENCODER_READING, Kind.SCALE_READING)
@FEW
@given(data=st.data(), position=POSITION_M, turn=TURN_RAD_M)
def test_error_of_a_reading_is_within_its_amplitude(
    effect: ModuleType, data: Any, position: float, turn: float
) -> None:
    p = data.draw(parameters(effect))
    assert abs(effect.error_m(p, position, turn)) <= abs(p.amplitude_m) * (1.0 + 1e-12)


@of_kind(Kind.CROSS_READING)
@FEW
@given(data=st.data(), other=POSITION_M)
def test_error_by_another_axis_is_none_where_that_axis_is_at_its_zero(
    effect: ModuleType, data: Any, other: float
) -> None:
    p = data.draw(parameters(effect))
    assert math.isfinite(effect.error_m(p, effect.State(other)))
    assert effect.error_m(p, effect.State(0.0)) == 0.0


@of_kind(Kind.POSITION_ERROR)
@FEW
@given(data=st.data(), position=POSITION_M, kelvin=st.floats(200.0, 400.0))
def test_slope_is_the_derivative_of_the_position_error(
    effect: ModuleType, data: Any, position: float, kelvin: float
) -> None:
    p, turn, step = data.draw(parameters(effect)), 2.0 * math.pi / 0.01, 1e-7
    s = own_state(effect)
    for field in s[0].dtype.names if s else ():
        s[0][field] = kelvin
    ahead = effect.error_m(p, *s, position + step, turn)
    behind = effect.error_m(p, *s, position - step, turn)
    slope = effect.slope(p, *s, position, turn)
    assert math.isfinite(ahead)
    assert slope == pytest.approx((ahead - behind) / (2.0 * step), rel=1e-3, abs=1e-6)


@of_kind(Kind.COUPLING)
@FEW
@given(data=st.data(), amplitude_m=st.floats(1e-7, 1e-4))
def test_coupling_makes_no_energy_over_a_closed_path(
    effect: ModuleType, data: Any, amplitude_m: float
) -> None:
    p = data.draw(parameters(effect))
    phase = np.linspace(0.0, 2.0 * math.pi, 401)
    deflection = amplitude_m * np.sin(phase)
    rate = amplitude_m * np.cos(phase) / DT_S
    force = np.array([effect.force_n(p, d, r) for d, r in zip(deflection, rate, strict=True)])
    work = np.trapezoid(force, deflection)
    assert np.isfinite(force).all()
    assert work >= -1e-9 * np.abs(force).max() * amplitude_m


@of_kind(Kind.GAP)
@FEW
@given(data=st.data(), gap_m=st.floats(-0.05, 0.05))
def test_play_shortens_the_gap_and_keeps_its_sign(effect: ModuleType, data: Any, gap_m: float) -> None:
    deflection = effect.deflection_m(data.draw(parameters(effect)), gap_m)
    assert 0.0 <= deflection * math.copysign(1.0, gap_m) <= abs(gap_m)


@of_kind(Kind.SENSOR)
@FEW
@given(data=st.data(), position=POSITION_M)
def test_sensor_reads_within_half_a_count(effect: ModuleType, data: Any, position: float) -> None:
    p = data.draw(parameters(effect))
    count = effect.counts(p, position)
    assert isinstance(count, int)
    assert abs(count * p.resolution_m - position) <= 0.5 * p.resolution_m * (1.0 + 1e-6) + 1e-15


@of_kind(Kind.WINDING)
@FEW
@given(data=st.data(), current=st.floats(-100.0, 100.0), volts=st.floats(-500.0, 500.0))
def test_winding_moves_towards_its_final_current(
    effect: ModuleType, data: Any, current: float, volts: float
) -> None:
    p = data.draw(parameters(effect))
    final = volts / p.resistance_v_a
    after = effect.current_a(p, current, volts, 0.0, effect.decay(p, DT_S))
    assert min(current, final) - 1e-9 * abs(final) <= after <= max(current, final) + 1e-9 * abs(final)


@of_kind(Kind.FRICTION_SPEED)
@FEW
@given(data=st.data(), velocity=st.floats(-5.0, 5.0))
def test_level_of_a_velocity_is_finite(effect: ModuleType, data: Any, velocity: float) -> None:
    p = data.draw(parameters(effect))
    assert math.isfinite(effect.level_n(p, velocity))


@of_kind(Kind.CHANGE_IN_TIME)
@FEW
@given(data=st.data(), time_s=st.floats(0.0, 1e5))
def test_changes_in_time_are_finite(effect: ModuleType, data: Any, time_s: float) -> None:
    p = data.draw(parameters(effect))
    for change in (effect.force_n, effect.level_n, effect.damping_n_s_m, effect.added_kg):
        assert math.isfinite(change(p, time_s))


@of_kind(Kind.CHANGE_WITH_POSITION)
@FEW
@given(data=st.data(), position_m=st.floats(-20.0, 20.0))
def test_changes_with_the_position_are_finite(effect: ModuleType, data: Any, position_m: float) -> None:
    p = data.draw(parameters(effect))
    assert math.isfinite(effect.damping_n_s_m(p, position_m))
    assert math.isfinite(effect.added_kg(p, position_m))


@of_kind(Kind.MEMORY_FORCE)
@FEW
@given(data=st.data(), moves=st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=40))
def test_a_force_with_a_memory_is_zero_at_power_up_and_dies_away_at_rest(
    effect: ModuleType, data: Any, moves: list[float]
) -> None:
    p, [s] = data.draw(parameters(effect)), own_state(effect)
    assert effect.force_n(p, s) == 0.0
    for velocity in moves:
        effect.advance(p, s, velocity, DT_S)
        assert math.isfinite(effect.force_n(p, s))
    before = abs(effect.force_n(p, s))
    effect.advance(p, s, 0.0, DT_S)
    assert abs(effect.force_n(p, s)) <= before
