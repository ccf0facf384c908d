"""The tick over flat arrays, for the daemon: numba boxes a NamedTuple field by field, an array at one go.

The same `axis_tick` behind it; a call from Python takes a tenth of the time. The order of the values is that
of the fields, depth first; the tables (`learned`, `surface`, `screw`) are arrays already and go beside them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from servo_ctrl.control.jit import kernel
from servo_ctrl.control.params import (
    AxisLimits,
    AxisParams,
    BacklashTakeUp,
    DisturbanceObserver,
    Feedforward,
    FrictionPulse,
    FuzzyPd,
    PositionLoop,
    SampledDualLoop,
    ScrewError,
    VelocityLoop,
)
from servo_ctrl.control.tick import axis_tick
from servo_ctrl.control.types import (
    AxisCommand,
    AxisSample,
    AxisState,
    ObserverState,
    OffsetMotion,
    PositionState,
    PulseShape,
    PulseState,
    SampledState,
    initial_state,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    Array = NDArray[np.float64]


POSITION_ERROR, OBSERVER_VELOCITY = 6, 18
"""Where `state` has the last position error and the observer's velocity; NaN there leaves a gap out."""
CORRECTION = AxisCommand._fields.index("correction_m")
"""Where `command` has how far the motor is led beside the command."""


class FlatAxis(NamedTuple):
    """What `flat_tick` works on; `state` and `command` are changed in place."""

    params: Array
    learned: Array
    surface: Array
    screw: Array
    state: Array
    sample: Array
    command: Array


def flat_axis(params: AxisParams, motor_position_m: float) -> FlatAxis:
    """Arrays for an axis at rest at `motor_position_m` (metres)."""
    return FlatAxis(
        flat(params),
        np.ascontiguousarray(params.pulse.learned, dtype=np.float64),
        np.ascontiguousarray(params.fuzzy.surface, dtype=np.float64),
        np.ascontiguousarray(params.screw.table, dtype=np.float64),
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
def params_of(p: Array, learned: Array, surface: Array, screw: Array) -> AxisParams:
    """The parameters back from their numbers."""
    return AxisParams(
        p[0],
        int(p[1]),
        PositionLoop(p[2], p[3], p[4], p[5], p[6] != 0.0),
        FuzzyPd(p[7] != 0.0, p[8], p[9], p[10], p[11], p[12], p[13], p[14], surface),
        VelocityLoop(p[15], p[16], int(p[17]), p[18]),
        Feedforward(p[19], p[20]),
        FrictionPulse(p[21] != 0.0, p[22], p[23], learned),
        DisturbanceObserver(p[24] != 0.0, p[25], p[26], p[27]),
        ScrewError(p[28] != 0.0, screw),
        BacklashTakeUp(p[29] != 0.0, p[30], p[31], p[32]),
        SampledDualLoop(p[33] != 0.0, p[34], p[35], int(p[36]), p[37], p[38] != 0.0, p[39], p[40]),
        AxisLimits(p[41], p[42], p[43]),
    )


@kernel
def state_of(s: Array) -> AxisState:
    """The state back from its numbers."""
    return AxisState(
        s[0],
        s[1],
        s[2],
        s[3],
        s[4],
        s[5],
        PositionState(s[6], s[7], s[8]),
        PulseState(s[9], s[10], s[11], PulseShape(s[12], s[13], s[14], s[15], s[16])),
        ObserverState(s[17], s[18], s[19]),
        s[20],
        motion_of(s, 21),
        SampledState(s[26], int(s[27]), motion_of(s, 28)),
    )


@kernel
def motion_of(s: Array, at: int) -> OffsetMotion:
    """The offset motion whose numbers begin at `at`."""
    return OffsetMotion(s[at], s[at + 1], s[at + 2], s[at + 3], s[at + 4] != 0.0)


@kernel
def put_motion(s: Array, at: int, motion: OffsetMotion) -> None:
    """The offset motion into its numbers."""
    s[at] = motion.from_m
    s[at + 1] = motion.to_m
    s[at + 2] = motion.elapsed_s
    s[at + 3] = motion.duration_s
    s[at + 4] = 1.0 if motion.smooth else 0.0


@kernel
def flat_tick(p: Array, learned: Array, surface: Array, screw: Array, s: Array, x: Array, c: Array) -> None:
    """One `axis_tick`: parameters and tables, and sample `x`, into state `s` and command `c`."""
    sample = AxisSample(x[0], x[1], x[2], x[3], x[4], x[5], x[6])
    state, command = axis_tick(params_of(p, learned, surface, screw), state_of(s), sample)
    s[0] = state.motor_position_1_m
    s[1] = state.motor_position_2_m
    s[2] = state.velocity_m_s
    s[3] = state.integral_n
    s[4] = state.velocity_command_m_s
    s[5] = state.force_n
    for i in range(3):
        s[6 + i] = state.position_loop[i]
    s[9] = state.pulse.position_command_m
    s[10] = state.pulse.direction
    s[11] = state.pulse.age_s
    for i in range(5):
        s[12 + i] = state.pulse.shape[i]
    for i in range(3):
        s[17 + i] = state.observer[i]
    s[20] = state.screw_error_m
    put_motion(s, 21, state.take_up)
    s[26] = state.sampled.rest_s
    s[27] = float(state.sampled.corrections)
    put_motion(s, 28, state.sampled.motion)
    c[0] = command.position_m
    c[1] = command.velocity_m_s
    c[2] = command.force_n
    c[3] = command.force_offset_n
    c[4] = command.position_error_m
    c[5] = command.motor_velocity_m_s
    c[6] = command.pulse_m_s
    c[7] = command.disturbance_n
    c[8] = command.correction_m
    c[9] = 1.0 if command.saturated else 0.0
    c[10] = float(command.status)
