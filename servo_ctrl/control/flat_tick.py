"""The tick over flat arrays, for the daemon: numba boxes a NamedTuple field by field, an array at one go.

The same `axis_tick` behind it; a call from Python takes a tenth of the time. The order of the values is that
of the fields, depth first; `FrictionPulse.learned` is an array already and goes beside them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from servo_ctrl.control.jit import kernel
from servo_ctrl.control.tick import axis_tick
from servo_ctrl.control.types import (
    AxisCommand,
    AxisLimits,
    AxisParams,
    AxisSample,
    AxisState,
    DisturbanceObserver,
    Feedforward,
    FrictionPulse,
    ObserverState,
    PositionLoop,
    PulseShape,
    PulseState,
    VelocityLoop,
    initial_state,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    Array = NDArray[np.float64]


OBSERVER_VELOCITY = 15
"""Where `state` has the observer's velocity; NaN there makes the observer start anew after a gap."""


class FlatAxis(NamedTuple):
    """What `flat_tick` works on; `state` and `command` are changed in place."""

    params: Array
    learned: Array
    state: Array
    sample: Array
    command: Array


def flat_axis(params: AxisParams, motor_position_m: float) -> FlatAxis:
    """Arrays for an axis at rest at `motor_position_m` (metres)."""
    return FlatAxis(
        flat(params),
        np.ascontiguousarray(params.pulse.learned, dtype=np.float64),
        flat(initial_state(motor_position_m)),
        np.zeros(len(AxisSample._fields)),
        np.zeros(len(AxisCommand._fields)),
    )


def flat(values: tuple[object, ...]) -> Array:
    """The numbers of a tuple of tuples, depth first; arrays are left out."""
    return np.array(list(_numbers(values)), dtype=np.float64)


def _numbers(values: tuple[object, ...]) -> Iterator[float]:
    for value in values:
        if isinstance(value, tuple):
            yield from _numbers(value)
        elif isinstance(value, int | float):
            yield float(value)


@kernel
def params_of(p: Array, learned: Array) -> AxisParams:
    """The parameters back from their numbers."""
    return AxisParams(
        p[0],
        int(p[1]),
        PositionLoop(p[2], p[3] != 0.0),
        VelocityLoop(p[4], p[5], int(p[6]), p[7]),
        Feedforward(p[8], p[9]),
        FrictionPulse(p[10] != 0.0, p[11], p[12], learned),
        DisturbanceObserver(p[13] != 0.0, p[14], p[15], p[16]),
        AxisLimits(p[17], p[18], p[19]),
    )


@kernel
def state_of(s: Array) -> AxisState:
    """The state back from its numbers."""
    shape = PulseShape(s[9], s[10], s[11], s[12], s[13])
    pulse = PulseState(s[6], s[7], s[8], shape)
    return AxisState(s[0], s[1], s[2], s[3], s[4], s[5], pulse, ObserverState(s[14], s[15], s[16]))


@kernel
def flat_tick(p: Array, learned: Array, s: Array, x: Array, c: Array) -> None:
    """One `axis_tick`: parameters `p`, `learned` and sample `x` into state `s` and command `c`."""
    sample = AxisSample(x[0], x[1], x[2], x[3], x[4], x[5], x[6])
    state, command = axis_tick(params_of(p, learned), state_of(s), sample)
    s[0] = state.motor_position_1_m
    s[1] = state.motor_position_2_m
    s[2] = state.velocity_m_s
    s[3] = state.integral_n
    s[4] = state.velocity_command_m_s
    s[5] = state.force_n
    s[6] = state.pulse.position_command_m
    s[7] = state.pulse.direction
    s[8] = state.pulse.age_s
    for i in range(5):
        s[9 + i] = state.pulse.shape[i]
    for i in range(3):
        s[14 + i] = state.observer[i]
    c[0] = command.position_m
    c[1] = command.velocity_m_s
    c[2] = command.force_n
    c[3] = command.force_offset_n
    c[4] = command.position_error_m
    c[5] = command.motor_velocity_m_s
    c[6] = command.pulse_m_s
    c[7] = command.disturbance_n
    c[8] = 1.0 if command.saturated else 0.0
    c[9] = float(command.status)
