"""Friction compensation pulse on the velocity command: a trapezoid (Feng et al. 2015, section 2), or two.

    p(t) = s A clip(min(t / Tr, (T - t) / Tr), 0, 1),   t from the reversal t1, s the new direction

t1 is the sample at which the increment of the position command changes its sign; rests in between do not
count. What shape the pulse takes is read at t1 from the learned functions, at the reverse acceleration of
that very reversal, and stays until the next one.

The trailing pulse is ours: another trapezoid, of either sign, that begins later. Friction falls when the
last contact lets go, and the force that the first pulse has built up throws the table ahead. Without it
(amplitude 0) the pulse is the paper's.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from servo_ctrl.control.jit import kernel
from servo_ctrl.control.limits import clamp
from servo_ctrl.control.types import PulseShape, PulseState

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from servo_ctrl.control.params import FrictionPulse

REST_M = 1e-12
"""A smaller increment of the position command is rest: rounding must not look like a reversal."""


@kernel
def shape_at(learned: NDArray[np.float64], reverse_m_s2: float) -> PulseShape:
    """The shape for a reverse acceleration: linear between the columns of `learned`, level outside."""
    last = learned.shape[1] - 1
    lower, upper = 0, last
    while upper - lower > 1:
        middle = (lower + upper) // 2
        if learned[0, middle] <= reverse_m_s2:
            lower = middle
        else:
            upper = middle
    span = learned[0, upper] - learned[0, lower]
    share = min(max((reverse_m_s2 - learned[0, lower]) / span, 0.0), 1.0) if span > 0.0 else 0.0
    return PulseShape(
        learned[1, lower] + share * (learned[1, upper] - learned[1, lower]),
        learned[2, lower] + share * (learned[2, upper] - learned[2, lower]),
        learned[3, lower] + share * (learned[3, upper] - learned[3, lower]),
        learned[4, lower] + share * (learned[4, upper] - learned[4, lower]),
        learned[5, lower] + share * (learned[5, upper] - learned[5, lower]),
    )


@kernel
def advance_pulse(
    p: FrictionPulse, state: PulseState, position_command_m: float, acceleration_m_s2: float, period_s: float
) -> PulseState:
    """The pulse one period later; a reversal begins a new one. Disabled, none begins."""
    increment_m = position_command_m - state.position_command_m
    if abs(increment_m) < REST_M:
        return PulseState(position_command_m, state.direction, state.age_s + period_s, state.shape)
    direction = 1.0 if increment_m > 0.0 else -1.0
    if direction * state.direction >= 0.0:
        return PulseState(position_command_m, direction, state.age_s + period_s, state.shape)
    shape = PulseShape(0.0, 0.0, 0.0, 0.0, 0.0)
    if p.enabled:
        shape = shape_at(p.learned, abs(acceleration_m_s2))
    return PulseState(position_command_m, direction, 0.0, shape)


@kernel
def older_pulse(state: PulseState, period_s: float) -> PulseState:
    """The pulse one period later, when there was no position command to look at."""
    return PulseState(state.position_command_m, state.direction, state.age_s + period_s, state.shape)


@kernel
def trapezoid(age_s: float, duration_s: float, rise_s: float) -> float:
    """clip(min(t / Tr, (T - t) / Tr), 0, 1); a pulse of less than two rise times stays a triangle."""
    return min(max(min(age_s, duration_s - age_s) / rise_s, 0.0), 1.0)


@kernel
def pulse_m_s(p: FrictionPulse, state: PulseState) -> float:
    """Velocity of the pulse, m/s, within +-A_max; 0 outside of it."""
    shape = state.shape
    main_m_s = shape.amplitude_m_s * trapezoid(state.age_s, shape.duration_s, p.rise_s)
    trailing_m_s = shape.trailing_amplitude_m_s * trapezoid(
        state.age_s - shape.trailing_start_s, shape.trailing_duration_s, p.rise_s
    )
    return state.direction * clamp(main_m_s + trailing_m_s, p.amplitude_max_m_s)
