"""The disturbance observer against scipy, and against the exact motion of a mass."""

import math

import numpy as np
import pytest
from compensation_off import NO_FUZZY, NO_LEADING, NO_NOTCH, NO_PULSE, NO_WAVEFORM, p_loop
from scipy import signal

from kernels.arrays import Array
from servo_ctrl.control import velocity_loop
from servo_ctrl.control.compensation import disturbance_observer, feedforward
from servo_ctrl.control.compensation.disturbance_observer import observed_disturbance
from servo_ctrl.control.limits import AxisLimits
from servo_ctrl.control.tick import AxisParams, axis_tick, initial_state
from servo_ctrl.control.types import AxisSample

T = 1e-3
BLEND = 0.03
FRESH = disturbance_observer.State(0.0, 0.0, math.nan)


def observed(p: disturbance_observer.Params, force_n: Array, velocity_m_s: Array) -> Array:
    state, found = FRESH, []
    for u, v in zip(force_n.tolist(), velocity_m_s.tolist(), strict=True):
        state = observed_disturbance(p, state, u, v, T)
        found.append(state.disturbance_n)
    return np.array(found)


def test_the_estimate_is_the_low_pass_filtered_difference_between_force_and_model() -> None:
    rng = np.random.default_rng(7)
    force, velocity = rng.normal(0.0, 50.0, 500), rng.normal(0.0, 1e-3, 500)
    p = disturbance_observer.Params(True, 70.0, 39.0, BLEND)
    # trapezoidal rule: over two periods the mean of force and velocity, and the difference of velocity
    left = signal.lfilter([0.5, 0.5], [1.0], force) - signal.lfilter([0.5, 0.5], [1.0], velocity) * 39.0
    left -= 70.0 * signal.lfilter([1.0, -1.0], [1.0], velocity) / T
    left[0] = 0.0  # one sample spans nothing
    expected = signal.lfilter([BLEND], [1.0, BLEND - 1.0], left)
    np.testing.assert_allclose(observed(p, force, velocity), expected, rtol=1e-9, atol=1e-9)


def test_a_constant_force_on_a_mass_comes_out_as_the_lag_alone_whatever_the_motor_does() -> None:
    # the motor's force is held over a period, hence motion is exact, and so must the alignment be
    mass, load = 70.0, 25.0
    force = np.random.default_rng(8).normal(0.0, 100.0, 400)
    a = (force - load) / mass
    v = np.concatenate(([0.0], np.cumsum(a * T)))
    q = np.concatenate(([0.0], np.cumsum(v[:-1] * T + 0.5 * a * T**2)))
    estimate = np.diff(q) / T
    found = observed(disturbance_observer.Params(True, mass, 0.0, BLEND), force, estimate)
    np.testing.assert_allclose(found, load * (1.0 - (1.0 - BLEND) ** np.arange(400)), rtol=1e-7, atol=1e-6)


def test_viscous_friction_of_the_model_is_no_disturbance() -> None:
    found = observed(
        disturbance_observer.Params(True, 70.0, 39.0, BLEND), np.full(600, 39.0 * 0.05), np.full(600, 0.05)
    )
    assert np.abs(found[1:]).max() < 1e-12


def test_the_estimate_is_frozen_while_the_force_is_not_measured() -> None:
    p = disturbance_observer.Params(True, 70.0, 0.0, BLEND)
    force = np.full(100, 20.0)
    force[50:60] = np.nan
    found = observed(p, force, np.zeros(100))
    assert (found[50:61] == found[49]).all()  # and one more sample, which spans the gap
    seen = np.arange(89)
    np.testing.assert_allclose(np.delete(found, np.arange(50, 61)), 20.0 * (1.0 - (1.0 - BLEND) ** seen))


def test_without_a_measured_force_it_adds_nothing() -> None:
    p = disturbance_observer.Params(True, 70.0, 0.0, BLEND)
    assert not observed(p, np.full(50, np.nan), np.linspace(0.0, 1.0, 50)).any()


def test_disabled_it_adds_nothing_and_resets_its_state() -> None:
    on = disturbance_observer.Params(True, 70.0, 0.0, BLEND)
    off = on._replace(enabled=False)
    state = observed_disturbance(off, disturbance_observer.State(12.0, 0.0, 5.0), 30.0, 0.1, T)
    assert state == disturbance_observer.State(0.0, 0.1, 30.0)
    # what it has seen meanwhile is not a jump when it is switched on again
    assert observed_disturbance(on, state, 30.0, 0.1, T).disturbance_n == pytest.approx(BLEND * 30.0)


def params(*, enabled: bool = True) -> AxisParams:
    return AxisParams(
        T,
        0,
        p_loop(0.0, False),
        NO_FUZZY,
        velocity_loop.Params(100.0, 0.0, 1, 1.0),
        NO_NOTCH,
        feedforward.Params(0.0, 0.0),
        NO_PULSE,
        disturbance_observer.Params(enabled, 70.0, 0.0, BLEND),
        NO_WAVEFORM,
        *NO_LEADING,
        AxisLimits(1e9, 40.0, 1e9),
    )


def sample(motor: float, force: float = 20.0) -> AxisSample:
    return AxisSample(0.0, 0.0, 0.0, 0.0, motor, math.nan, force)


def test_the_estimate_is_recorded_and_added_to_the_force_within_the_force_limit() -> None:
    states = {enabled: initial_state(0.0) for enabled in (True, False)}
    for k in range(200):
        force = 20.0 if k < 100 else 2000.0
        motor = 1e-5 * math.sin(0.1 * k)
        states[True], on = axis_tick(params(), states[True], sample(motor, force))
        states[False], off = axis_tick(params(enabled=False), states[False], sample(motor, force))
        assert off.disturbance_n == 0.0
        assert on.force_n == pytest.approx(min(off.force_n + on.disturbance_n, 40.0), abs=1e-9)
    assert on.disturbance_n > 1000.0
    assert on.saturated


@pytest.mark.parametrize("missing", [1, 9])
def test_a_gap_in_the_samples_of_an_axis_that_accelerates_is_no_disturbance(missing: int) -> None:
    # 1 m/s^2, and the force for it: nothing is left over
    state, found = initial_state(0.0), []
    for k in range(200):
        motor = math.nan if 100 <= k < 100 + missing else 0.5 * (k * T) ** 2
        state, command = axis_tick(params(), state, sample(motor, 70.0))
        found.append(command.disturbance_n)
    assert not any(found[100 : 100 + missing])
    good = np.delete(found, np.arange(100, 100 + missing))
    assert np.abs(good).max() < BLEND * 70.0  # the start from rest, where half a period is at rest
    assert abs(good[-1]) < abs(good[99])
