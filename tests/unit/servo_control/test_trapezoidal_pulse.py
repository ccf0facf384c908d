"""The friction pulse against its formula written out in numpy, for any command."""

import math

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from kernels.arrays import Array
from servo_ctrl.control.compensation import trapezoidal_pulse
from servo_ctrl.control.compensation.trapezoidal_pulse import REST_M, advance_pulse, pulse_m_s, shape_at
from servo_ctrl.control.tick import initial_state
from servo_ctrl.control.types import AxisSample
from servo_ctrl.learning import performance

T = 1e-3
RISE_S = 0.01
TWO = np.array([[0.1, 1.0], [0.06, 0.03], [4e-4, 1.2e-3], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]])


@numba.njit
def _run(
    p: trapezoidal_pulse.Params,
    state: trapezoidal_pulse.State,
    command: Array,
    acceleration: Array,
    out: Array,
) -> trapezoidal_pulse.State:
    for k in range(len(command)):
        sample = AxisSample(command[k], 0.0, acceleration[k], 0.0, 0.0, 0.0, 0.0, 0.0)
        state = advance_pulse(p, state, sample, T)
        out[0, k] = pulse_m_s(p, state)
        out[1, k] = state.age_s
    return state


def pulses(learned: Array, position_m: Array, acceleration_m_s2: Array, **changed: object) -> Array:
    """(2, n): pulse and age at every sample."""
    p = trapezoidal_pulse.Params(True, RISE_S, 1.0, np.ascontiguousarray(learned))._replace(**changed)
    out = np.empty((2, len(position_m)))
    _run(p, initial_state(position_m[0]).pulse, position_m, acceleration_m_s2, out)
    return out


def sweep(samples: int = 3000) -> tuple[Array, Array]:
    """A sine that becomes faster: every reversal has an acceleration of its own."""
    t = np.arange(samples) * T
    phase = 2.0 * math.pi * (t + 0.4 * t**2)
    rate = 2.0 * math.pi * (1.0 + 0.8 * t)
    return 2e-3 * np.sin(phase), -2e-3 * (np.sin(phase) * rate**2 - np.cos(phase) * 2.0 * math.pi * 0.8)


def written_out(learned: Array, position_m: Array, acceleration_m_s2: Array) -> Array:
    """p(t) = s A clip(min(t / Tr, (T - t) / Tr), 0, 1) after each reversal, and the trailing one likewise."""
    total = np.zeros_like(position_m)
    starts = performance.reversals(position_m)
    for start, stop in zip(starts, [*starts[1:], len(position_m)], strict=True):
        a = abs(acceleration_m_s2[start])
        duration, amplitude, later, length, height = (np.interp(a, learned[0], row) for row in learned[1:])
        t = np.arange(stop - start) * T
        main = amplitude * np.clip(np.minimum(t / RISE_S, (duration - t) / RISE_S), 0.0, 1.0)
        t = t - later
        trailing = height * np.clip(np.minimum(t / RISE_S, (length - t) / RISE_S), 0.0, 1.0)
        total[start:stop] = np.sign(position_m[start] - position_m[start - 1]) * (main + trailing)
    return total


def test_every_sample_is_the_written_out_formula_at_the_acceleration_of_its_reversal() -> None:
    position, acceleration = sweep()
    found, _ = pulses(TWO, position, acceleration)
    expected = written_out(TWO, position, acceleration)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)
    heights = [np.abs(part).max() for part in np.split(expected, performance.reversals(position))[1:]]
    assert len(set(heights)) > 5  # they do differ


def test_a_second_trapezoid_follows_where_one_was_learned() -> None:
    learned = np.array([[0.1, 1.0], [0.06, 0.03], [4e-4, 1.2e-3], [0.05, 0.04], [0.03, 0.05], [-3e-4, 2e-4]])
    position, acceleration = sweep()
    found, _ = pulses(learned, position, acceleration)
    np.testing.assert_allclose(found, written_out(learned, position, acceleration), rtol=1e-9, atol=1e-12)


def test_a_short_pulse_is_a_triangle() -> None:
    learned = np.array([[1.0], [0.012], [1e-3], [0.0], [0.0], [0.0]])
    found, _ = pulses(learned, np.array([0.0, *np.linspace(1.0, 0.0, 20)]), np.ones(21))
    assert found.min() == pytest.approx(-0.6e-3)  # T / 2 Tr of the amplitude
    assert np.count_nonzero(found) == 11


@settings(deadline=None)  # the first may have to compile
@given(
    st.lists(
        st.sampled_from([0.0, 1e-13, -1e-13, REST_M, -REST_M, 1e-9, -1e-9, 3e-6, -3e-6, 1e-3, -1e-3]),
        min_size=1,
        max_size=60,
    ),
    st.floats(-0.1, 0.1),
)
def test_a_pulse_begins_at_the_reversal_that_the_indicators_detect(steps: list[float], start: float) -> None:
    position = start + np.cumsum([0.0, *steps])
    _, age = pulses(TWO, position, np.ones(len(position)))
    np.testing.assert_array_equal(np.flatnonzero(age == 0.0), performance.reversals(position))


@settings(deadline=None)  # the first may have to compile
@given(
    arrays.arrays(np.float64, 3, elements=st.floats(-1e-2, 1e-2)),
    arrays.arrays(np.float64, 3, elements=st.floats(0.1, 20.0)),
)
def test_the_pulse_matches_the_formula_on_smooth_paths(amplitudes: Array, frequencies: Array) -> None:
    t = np.arange(1000) * T
    position = amplitudes @ np.sin(np.outer(2.0 * math.pi * frequencies, t))
    _, age = pulses(TWO, position, np.ones(len(position)))
    np.testing.assert_array_equal(np.flatnonzero(age == 0.0), performance.reversals(position))


def test_standstill_is_the_same_for_the_pulse_and_for_the_indicators() -> None:
    assert REST_M == performance.REST_M


@settings(deadline=None)  # the first may have to compile
@given(st.integers(1, 6), st.data())
def test_the_shape_is_linear_between_what_was_learned_and_level_outside(
    columns: int, data: st.DataObject
) -> None:
    value = st.floats(-1.0, 1.0)
    accelerations = data.draw(
        st.lists(st.floats(1e-3, 1.0), min_size=columns, max_size=columns, unique=True).map(sorted)
    )
    rows = data.draw(arrays.arrays(np.float64, (5, columns), elements=value))
    at = data.draw(st.floats(0.0, 2.0) | st.sampled_from(accelerations))
    found = shape_at(np.ascontiguousarray(np.vstack((accelerations, rows))), float(at))
    expected = [np.interp(at, accelerations, row) for row in rows]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


@settings(deadline=None)  # the first may have to compile
@given(
    arrays.arrays(np.float64, (5, 2), elements=st.floats(-1.0, 1.0)),
    st.floats(1e-6, 0.1),
    st.floats(1e-4, 0.1),
)
def test_no_pulse_is_ever_beyond_its_largest_amplitude(rows: Array, largest: float, rise: float) -> None:
    position, acceleration = sweep(1200)
    learned = np.vstack(([0.05, 0.5], rows))
    found, _ = pulses(learned, position, acceleration, amplitude_max_m_s=largest, rise_s=rise)
    assert np.abs(found).max() <= largest
    assert np.isfinite(found).all()


def test_disabled_there_is_no_pulse() -> None:
    found, _ = pulses(TWO, *sweep(), enabled=False)
    assert not found.any()


def test_a_pulse_disabled_while_active_finishes_and_none_follows() -> None:
    position, acceleration = sweep()
    starts = performance.reversals(position)
    p = trapezoidal_pulse.Params(True, RISE_S, 1.0, TWO)
    out = np.empty((2, len(position)))
    change = starts[1] + 7  # in the second pulse
    state = _run(
        p, initial_state(position[0]).pulse, position[:change], acceleration[:change], out[:, :change]
    )
    off = p._replace(enabled=False)
    _run(off, state, position[change:], acceleration[change:], out[:, change:])
    expected = written_out(TWO, position, acceleration)
    np.testing.assert_allclose(out[0, : starts[2]], expected[: starts[2]], rtol=1e-9, atol=1e-12)
    assert not out[0, starts[2] :].any()


def test_the_next_reversal_replaces_an_active_pulse() -> None:
    there, back = np.linspace(0.0, 1e-3, 21), np.linspace(1e-3, 0.5e-3, 16)[1:]
    position = np.concatenate((there, back, back[-1] + np.linspace(0.0, 1e-3, 81)[1:]))
    acceleration = np.where(np.arange(len(position)) < 30, 0.1, 1.0)
    found, _ = pulses(TWO, position, acceleration)
    assert found[21] == 0.0
    assert found[35] == -4e-4  # the first is at its height
    assert found[36] == 0.0
    assert found[46:57] == pytest.approx(1.2e-3)
    assert not found[66:].any()


def test_an_axis_that_has_not_moved_yet_has_no_reversal() -> None:
    state = initial_state(0.02).pulse
    assert state == trapezoidal_pulse.State(
        0.02, 0.0, 0.0, trapezoidal_pulse.PulseShape(0.0, 0.0, 0.0, 0.0, 0.0)
    )
    for first in (0.01, 0.03):
        found, _ = pulses(TWO, np.array([0.02, first, first]), np.ones(3))
        assert not found.any()
