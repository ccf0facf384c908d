"""What every effect of friction must do, over random parameters and inputs within their bounds."""

import math
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from effect_draws import DT_S, FEW, POSITION_M, at_rest, of_kind, own_state, parameters
from hypothesis import given, settings
from hypothesis import strategies as st

from hil_sim.physics.kinds import Kind
from hil_sim.physics.registry import EFFECTS
from hil_sim.plant.layout import AXIS_PARAMS, write_params
from hil_sim.plant.sliding import slide
from kernels.quantities import section_of

VELOCITY_M_S = st.floats(-5.0, 5.0)
LEVEL_N = st.floats(0.0, 1e4)
USE = st.tuples(st.floats(0.0, 1e7), st.floats(0.0, 1e6))
"""Time s, and what the effect remembers: a distance m, an excess temperature K."""
STEEPEST = 20.0 / 1e-3  # of the factors: 20 within a millisecond
OF_SLIDING = {
    Kind.FRICTION_LEVEL,
    Kind.FRICTION_POSITION,
    Kind.FRICTION_DWELL,
    Kind.FRICTION_DIRECTION,
    Kind.FRICTION_CHANGE,
    Kind.DAMPING,
}


def changed(effect: ModuleType, p: Any, use: tuple[float, ...]) -> tuple[float, float]:
    s = (effect.State(use[1]),) if hasattr(effect, "State") else ()
    factors: tuple[float, float] = effect.factors(p, *s, use[0])
    return factors


@of_kind(Kind.FRICTION_LEVEL)
@FEW
@given(data=st.data(), speed=st.floats(0.0, 5.0))
def test_friction_level_keeps_its_sign_and_never_grows_with_speed(
    effect: ModuleType, data: Any, speed: float
) -> None:
    p = data.draw(parameters(effect))
    level, faster = effect.level_n(p, speed), effect.level_n(p, 1.1 * speed)
    assert math.isfinite(level)
    assert min(level, 0.0) <= faster <= max(level, 0.0)


@of_kind(Kind.FRICTION_POSITION)
@FEW
@given(data=st.data(), position=POSITION_M)
def test_level_of_a_place_is_finite(effect: ModuleType, data: Any, position: float) -> None:
    assert math.isfinite(effect.level_n(data.draw(parameters(effect)), position))


@of_kind(Kind.FRICTION_DIRECTION)
@FEW
@given(data=st.data())
def test_level_of_a_side_is_odd_and_at_rest_the_higher(effect: ModuleType, data: Any) -> None:
    p = data.draw(parameters(effect))
    assert effect.level_n(p, 1.0) == -effect.level_n(p, -1.0)
    assert effect.level_n(p, 0.0) == max(effect.level_n(p, 1.0), effect.level_n(p, -1.0))


@of_kind(Kind.FRICTION_DWELL)
@FEW
@given(data=st.data(), moves=st.lists(VELOCITY_M_S, min_size=1, max_size=30))
def test_level_of_the_rest_grows_at_rest_and_is_never_negative(
    effect: ModuleType, data: Any, moves: list[float]
) -> None:
    p, [s] = data.draw(parameters(effect)), own_state(effect)
    for velocity in moves:
        before = effect.level_n(p, s)
        effect.slide(p, s, velocity, DT_S)
        assert effect.level_n(p, s) >= 0.0
        if velocity == 0.0:
            assert effect.level_n(p, s) >= before


@of_kind(Kind.DAMPING)
@FEW
@given(data=st.data(), velocity=VELOCITY_M_S)
def test_damping_is_finite(effect: ModuleType, data: Any, velocity: float) -> None:
    assert math.isfinite(effect.damping_n_s_m(data.draw(parameters(effect)), velocity))


@settings(max_examples=25, deadline=None)
@given(data=st.data(), pushes=st.lists(st.floats(-2e3, 2e3), min_size=5, max_size=30))
def test_all_of_friction_together_never_pushes_the_table(data: Any, pushes: list[float]) -> None:
    """Every level and damping at once, with any parameters: sliding, it takes energy at every substep."""
    p, s = np.zeros(1, AXIS_PARAMS)[0], at_rest()
    for effect in EFFECTS:
        if effect.KIND in OF_SLIDING:
            write_params(p[section_of(effect)], data.draw(parameters(effect)))
    for push_n in pushes:
        for _ in range(10):
            before_m_s = float(s["table_velocity_m_s"])
            after_m_s = slide(p, s, True, 50.0, before_m_s, push_n, DT_S)
            free_m_s = before_m_s + push_n * DT_S / 50.0
            assert min(0.0, free_m_s) <= after_m_s <= max(0.0, free_m_s)
            s["table_velocity_m_s"] = after_m_s
            s["table_position_m"] += after_m_s * DT_S


@of_kind(Kind.FRICTION_CHANGE)
@FEW
@given(data=st.data(), use=USE)
def test_changed_friction_stays_finite_and_never_pushes(effect: ModuleType, data: Any, use: Any) -> None:
    for factor in changed(effect, data.draw(parameters(effect)), use):
        assert math.isfinite(factor)
        assert factor >= 0.0


@of_kind(Kind.FRICTION_CHANGE)
@FEW
@given(data=st.data(), use=USE)
def test_friction_begins_at_its_configured_level_and_changes_continuously(
    effect: ModuleType, data: Any, use: Any
) -> None:
    p = data.draw(parameters(effect))
    assert changed(effect, p, (0.0, 0.0)) == pytest.approx((1.0, 1.0))
    later = tuple(value + 1e-9 for value in use)
    step = max(b - a for a, b in zip(use, later, strict=True))  # large numbers lie further apart
    assert changed(effect, p, later) == pytest.approx(changed(effect, p, use), abs=step * STEEPEST + 1e-12)


@of_kind(Kind.PRESLIDING, Kind.PRESLIDING_LEVEL)
@FEW
@given(data=st.data(), moves=st.lists(st.tuples(VELOCITY_M_S, LEVEL_N), min_size=1, max_size=40))
def test_presliding_stays_finite_and_within_the_highest_level(
    effect: ModuleType, data: Any, moves: list[tuple[float, float]]
) -> None:
    p, [s] = data.draw(parameters(effect)), own_state(effect)
    highest = max(level for _, level in moves)
    for velocity, level in moves:
        _, damping = effect.force_and_damping(p, s, velocity, level)
        effect.slide(p, s, velocity, level, DT_S)
        force, _ = effect.force_and_damping(p, s, velocity, level)
        assert math.isfinite(damping)
        assert damping >= 0.0
        assert abs(force) <= highest * (1.0 + 1e-9) + 1e-9


@of_kind(Kind.PRESLIDING, Kind.PRESLIDING_LEVEL)
@settings(max_examples=25, deadline=None)
@given(data=st.data(), amplitude_m=st.floats(1e-7, 2e-4), second=st.floats(0.0, 1.0), dip=st.floats(0.0, 0.9))
def test_presliding_gives_back_no_more_than_it_took(
    effect: ModuleType, data: Any, amplitude_m: float, second: float, dip: float
) -> None:
    """From rest, work done on it stays positive at every instant, also while the level falls with speed."""
    p, [s] = data.draw(parameters(effect)), own_state(effect)
    phase = np.linspace(0.0, 6.0 * math.pi, 6001)
    position_m = amplitude_m * (np.sin(phase) + second * np.sin(5.0 * phase)) / (1.0 + second)
    velocity_m_s = np.diff(position_m) / DT_S
    level_n = 50.0 * (1.0 - dip * (1.0 - np.exp(-np.abs(velocity_m_s) / 5e-3)))
    work, taken = 0.0, 0.0
    for velocity, level in zip(velocity_m_s, level_n, strict=True):
        before, _ = effect.force_and_damping(p, s, velocity, level)
        effect.slide(p, s, velocity, level, DT_S)
        after, _ = effect.force_and_damping(p, s, velocity, level)
        step = 0.5 * (before + after) * velocity * DT_S
        work += step
        taken += abs(step)
        assert work >= -1e-3 * taken - 1e-15
