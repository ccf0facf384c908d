"""The friction pulse in the tick, when inputs or commands are missing."""

import math

import numpy as np
import pytest
from compensation_off import NO_FUZZY, NO_LEADING, NO_NOTCH, NO_OBSERVER, NO_WAVEFORM, p_loop

from kernels.arrays import Array
from servo_ctrl.control import velocity_loop
from servo_ctrl.control.compensation import feedforward, trapezoidal_pulse
from servo_ctrl.control.limits import AxisLimits
from servo_ctrl.control.tick import AxisParams, axis_tick, initial_state
from servo_ctrl.control.types import AxisSample, Output
from servo_ctrl.learning import performance

T = 1e-3
LEARNED = np.array([[0.1, 1.0], [0.06, 0.03], [4e-4, 1.2e-3], [0.03, 0.03], [0.03, 0.03], [-2e-4, -3e-4]])


def sweep() -> tuple[Array, Array]:
    """A sine that becomes faster, and its acceleration."""
    t = np.arange(900) * T
    position = 2e-3 * np.sin(2.0 * math.pi * (t + 0.4 * t**2))
    return position, np.gradient(np.gradient(position, T), T)


def params() -> AxisParams:
    return AxisParams(
        T,
        int(Output.VELOCITY),
        p_loop(0.0, False),
        NO_FUZZY,
        velocity_loop.Params(0.0, 0.0, 1, 1.0),
        NO_NOTCH,
        feedforward.Params(0.0, 0.0),
        trapezoidal_pulse.Params(True, 0.01, 1.0, LEARNED),
        NO_OBSERVER,
        NO_WAVEFORM,
        *NO_LEADING,
        AxisLimits(1.0, 1.0, 1e9),
    )


def ticks(position_m: Array, acceleration_m_s2: Array, motor_m: Array) -> list[float]:
    state, found = initial_state(0.0), []
    for x, a, q in zip(position_m.tolist(), acceleration_m_s2.tolist(), motor_m.tolist(), strict=True):
        state, command = axis_tick(params(), state, AxisSample(x, 0.0, a, 0.0, q, math.nan, math.nan))
        assert command.status or command.velocity_m_s == command.pulse_m_s
        found.append(command.pulse_m_s)
    return found


@pytest.mark.parametrize("gap", [(0, 5), (1, 1), (10, 12), (-3, 20)], ids=str)
def test_cycles_without_inputs_change_nothing_about_the_pulse_around_them(gap: tuple[int, int]) -> None:
    position, acceleration = sweep()
    second = performance.reversals(position)[1]
    bad = slice(second + gap[0], second + gap[1])
    motor = np.zeros(len(position))
    whole = ticks(position, acceleration, motor)
    motor[bad] = np.nan
    found = ticks(position, acceleration, motor)
    assert not any(found[bad])
    good = np.isfinite(motor)
    np.testing.assert_array_equal(np.array(found)[good], np.array(whole)[good])


def test_a_command_that_is_no_number_does_not_stop_the_pulse() -> None:
    position, acceleration = sweep()
    first = performance.reversals(position)[0]
    whole = ticks(position, acceleration, np.zeros(len(position)))
    position[first + 8 : first + 12] = np.nan
    found = ticks(position, acceleration, np.zeros(len(position)))
    good = np.isfinite(position)
    np.testing.assert_array_equal(np.array(found)[good], np.array(whole)[good])


def test_a_reversal_without_a_command_counts_from_the_first_sample_after_it() -> None:
    position, acceleration = sweep()
    first = performance.reversals(position)[0]
    position[first - 2 : first + 3] = np.nan
    found = ticks(position, acceleration, np.zeros(len(position)))
    assert found[first + 3] == 0.0
    assert found[first + 4] < 0.0
