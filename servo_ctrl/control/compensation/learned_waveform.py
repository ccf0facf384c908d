"""Learned waveform compensation (LWC): friction force that is commanded before the reversal (ours).

    f(t) = clip(F(t + L) + s w(t - t1; a) + r) + clip(b v* + c a* + g j*)

t1 is the reversal, s the new direction, a the reverse acceleration, L the dead time of bus and amplifier.
F is presliding friction of the *commanded* motion, the sum of W_i D_i. Each D_i relaxes to the direction of
motion over a slip distance x_i: dD = (d - D)(1 - exp(-|dx| / x_i)) (Dahl 1968; several in parallel, like
the Maxwell slip elements of Al-Bender et al. 2005). b v* + c a* + g j* is what the feedforward of the loop
misses: viscous friction, wrong mass, half a period between the set point of the velocity and its difference
quotient, and the dead time of the inertia force. w is a free waveform that was learned from strokes
(`learning.reversal_waveform`). It is stretched in time, so that it covers the same distance at each
acceleration. Behind the reversal it is read at the distance x and the speed v of the command at t + L, as on
the motion of constant acceleration that passes there: a = v^2 / (2 x), but at least the slowest learned one:
w is still there where the axis stops. After a short motion x is the distance with as much slip
(`control.presliding_memory`), also before the first reversal and behind a time without power.

Where the axis turns before all has slipped, the friction of the new branch begins at that of the old one, and
where a loop closes it goes on as if the loop had not been (Masing 1926). So what w had come to at a reversal
is held until its loop closes. Before a reversal w fades out below the learned accelerations; above them it is
held.

r is what a rest of the command has added to friction, as far as it has been learned (`control.rest_memory`).

`control.reversal_forecast` predicts the reversal from the command alone.

While the waveform acts, pulse and observer do not: each would compensate the same friction a second time. It
acts in cst only; where the amplifier closes the loops, nothing is learned.
"""

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from kernels.jit import kernel
from kernels.quantities import Quantity
from kernels.record_layout import Table
from servo_ctrl.control.compensation import trapezoidal_pulse
from servo_ctrl.control.limits import clamp
from servo_ctrl.control.presliding_memory import (
    Branch,
    Turn,
    moved_by,
    relaxed_at,
    slip_travel_m,
    turned,
    without_closed_loop,
)
from servo_ctrl.control.rest_memory import Rest, rest_after, without_rest
from servo_ctrl.control.reversal_forecast import forecast, reversal_between_samples
from servo_ctrl.control.section import AxisFacts, Key, LawSection
from servo_ctrl.control.types import AxisSample
from servo_ctrl.control.waveform_table import AHEAD_S, wave_at_n, wave_n

SLIP_M = (2e-6, 8e-6, 30e-6, 100e-6)
"""Slip distances x_i. Chosen: presliding of rolling guides and screws spans 1 to 100 um."""
SPRING_BACK_M = SLIP_M[-1]
"""Longest way that friction springs back without power. Chosen: what was moved further was moved by something
else, there and back perhaps."""
SLIPPED = 1e-12
"""Distance of a memory from +-1 below which it is that, because exponentials take a fifth of a tick. Chosen:
of 170 N it is 0.2 nN."""
DEAD_PERIODS = 2.0
"""Dead time of the loop in periods: one until a set point acts, half a period each of hold and difference."""


@dataclass(frozen=True, kw_only=True)
class LearnedWaveformSettings:
    """Force along the command that strokes have learned; instead of pulse and observer once it is there."""

    enabled: Annotated[bool, Key("Whether it acts from the start, once something has been learned.")] = True
    limit_n: Annotated[float, Key("Bound of the learned force, newtons.", above=0.0)]
    amplifier_delay_ms: Annotated[
        float,
        Key("From a force set point in force to the force itself, milliseconds.", at_least=0.0, at_most=20.0),
    ] = 1.0


class Friction(NamedTuple):
    """Identified forces: levels W_i of presliding, and slopes over the motion, each of either sign."""

    level_1_n: float
    """W_1, at the shortest slip distance of `SLIP_M`."""
    level_2_n: float
    level_3_n: float
    level_4_n: float
    per_speed_n_s_m: float
    """b."""
    per_acceleration_kg: float
    """c."""
    per_jerk_kg_s: float
    """g."""


class Params(NamedTuple):
    """Bounds of the force, and the learned force."""

    enabled: bool
    limit_n: Annotated[float, Quantity("N", 0.0, math.inf, "bound of the learned force")]
    lead_s: Annotated[float, Quantity("s", 0.0, math.inf, "dead time L")]
    jerk_m_s3: Annotated[float, Quantity("m/s3", 0.0, math.inf, "bound of the command's jerk")]
    friction: Friction
    waves: Table
    """(m, 1 + n), m >= 1. A row: reverse acceleration, m/s^2, rising by rows; then w, N, one value per
    period from AHEAD_S before a reversal into the positive direction on."""
    rests: Table
    """(r, 1 + 2 N), r >= 1, of `control.rest_memory`: what a rest adds."""


class State(NamedTuple):
    """State of the compensation."""

    lead_position_m: float
    """Position command at t + L, one sample ago."""
    acceleration_m_s2: float
    """Acceleration of the command, one sample ago."""
    direction: float
    """Direction of the last motion, +1 or -1; 0 before the first."""
    branch: Branch
    """Where presliding has turned, between two samples."""
    memory_1: float
    """D_1."""
    memory_2: float
    memory_3: float
    memory_4: float
    rest: Rest
    """The last rest."""


NO_FRICTION = Friction(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
NEUTRAL = Params(
    enabled=False,
    limit_n=0.0,
    lead_s=0.0,
    jerk_m_s3=0.0,
    friction=NO_FRICTION,
    waves=np.zeros((1, 2)),
    rests=np.zeros((1, 3)),
)


def params_of(settings: LearnedWaveformSettings, axis: AxisFacts) -> Params:
    """Parameters before anything is learned: off; `config.kernel_params.with_waveform` sets the rest."""
    return NEUTRAL._replace(
        limit_n=float(settings.limit_n),
        lead_s=DEAD_PERIODS * axis.period_s + float(settings.amplifier_delay_ms) * 1e-3,
        jerk_m_s3=float(axis.jerk_m_s3),
    )


SECTION = LawSection(
    name="learned_waveform",
    meaning="Learned force around the reversals.",
    settings=LearnedWaveformSettings,
    params=params_of,
    neutral=NEUTRAL,
)


@kernel
def at_rest(position_command_m: float) -> State:
    """State before the first motion."""
    return State(
        lead_position_m=position_command_m,
        acceleration_m_s2=0.0,
        direction=0.0,
        branch=relaxed_at(position_command_m),
        memory_1=0.0,
        memory_2=0.0,
        memory_3=0.0,
        memory_4=0.0,
        rest=without_rest(),
    )


@kernel
def powered_again(state: State, moved_m: float, position_m: float) -> State:
    """State of an axis that gets power again at `position_m`, and that has moved by `moved_m` without it.

    Friction has sprung back until its springs held each other: no force is left, but a reversal in their
    memory. What has moved further than `SPRING_BACK_M`, or by a way that is not known (NaN), has no memory.
    """
    if state.direction == 0.0 or not abs(moved_m) <= SPRING_BACK_M:
        return at_rest(position_m)
    shift_m = position_m - moved_m - state.lead_position_m  # from the command to the motor's encoder
    branch, direction = moved_by(state.branch, shift_m), state.direction
    if moved_m * direction < 0.0:
        branch, direction = turned(branch, Turn(position_m - moved_m, 0.0)), -direction
    branch = without_closed_loop(branch, position_m, direction)
    return State(position_m, 0.0, direction, branch, 0.0, 0.0, 0.0, 0.0, without_rest())


@kernel
def relaxed(memory: float, step_m: float, slip_m: float) -> float:
    """D_i after a step of the command; without a step it is unchanged."""
    direction = 1.0 if step_m > 0.0 else -1.0
    if abs(direction - memory) < SLIPPED:
        return direction
    return memory + (direction - memory) * -math.expm1(-abs(step_m) / slip_m)


@kernel
def planned_force(
    p: Params, state: State, pulse: trapezoidal_pulse.State, sample: AxisSample, period_s: float
) -> tuple[float, State]:
    """The force, N, and the state one period later.

    `pulse`: state of the friction pulse at this sample, for the direction of motion. Disabled, the state
    follows the command and the force is 0.
    """
    direction = pulse.direction if pulse.direction != 0.0 else state.direction
    position_m, velocity_m_s = sample.position_command_m, sample.velocity_command_m_s
    acceleration_m_s2 = sample.acceleration_command_m_s2
    jerk_m_s3 = clamp((acceleration_m_s2 - state.acceleration_m_s2) / period_s, p.jerk_m_s3)
    lead_s = p.lead_s
    lead_position_m = position_m + lead_s * (
        velocity_m_s + lead_s * (0.5 * acceleration_m_s2 + lead_s * jerk_m_s3 / 6.0)
    )
    step_m = lead_position_m - state.lead_position_m
    branch = state.branch
    if direction * state.direction < 0.0:
        turn_m = reversal_between_samples(direction, position_m, velocity_m_s, acceleration_m_s2, period_s)
        old_n = wave_at_n(p.waves, slip_travel_m(branch, turn_m, -direction), 0.0, lead_s, period_s)
        branch = turned(branch, Turn(turn_m, branch.turn_1.held_n - direction * old_n))
    else:
        branch = without_closed_loop(branch, lead_position_m, direction)
    now = State(
        lead_position_m=lead_position_m,
        acceleration_m_s2=acceleration_m_s2,
        direction=direction,
        branch=branch,
        memory_1=relaxed(state.memory_1, step_m, SLIP_M[0]),
        memory_2=relaxed(state.memory_2, step_m, SLIP_M[1]),
        memory_3=relaxed(state.memory_3, step_m, SLIP_M[2]),
        memory_4=relaxed(state.memory_4, step_m, SLIP_M[3]),
        rest=rest_after(p.rests, state.rest, step_m, state.direction, period_s),
    )
    if not p.enabled:
        return 0.0, now
    friction = p.friction
    force_n = (
        friction.level_1_n * now.memory_1
        + friction.level_2_n * now.memory_2
        + friction.level_3_n * now.memory_3
        + friction.level_4_n * now.memory_4
    )
    until_s, foreseen_m_s2 = forecast(direction, velocity_m_s, acceleration_m_s2, jerk_m_s3)
    if until_s <= AHEAD_S:
        force_n -= direction * wave_n(p.waves, lead_s - until_s, foreseen_m_s2, lead_s, period_s)
    place_m = lead_position_m
    speed_m_s = direction * (velocity_m_s + lead_s * (acceleration_m_s2 + 0.5 * lead_s * jerk_m_s3))
    if until_s <= lead_s:  # the command at t + L has turned: what is left of the old branch is held
        place_m, speed_m_s = position_m + direction * 0.5 * foreseen_m_s2 * until_s * until_s, 0.0
    if pulse.direction != 0.0:  # without a motion since power came, no force is left in the springs
        distance_m = slip_travel_m(branch, place_m, direction)
        new_n = wave_at_n(p.waves, distance_m, max(speed_m_s, 0.0), lead_s, period_s)
        force_n += branch.turn_1.held_n + direction * new_n
    force_n += now.rest.force_n
    motion_n = (
        friction.per_speed_n_s_m * velocity_m_s
        + friction.per_acceleration_kg * acceleration_m_s2
        + friction.per_jerk_kg_s * jerk_m_s3
    )
    return clamp(force_n, p.limit_n) + clamp(motion_n, p.limit_n), now
