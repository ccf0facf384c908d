"""Learned waveform compensation (LWC): the force that friction needs, known before the reversal comes (ours).

    f(t) = clip(F(t + L) + s w(t - t1; a)) + clip(b v* + c a*)

t1 is the reversal, s the new direction, a the reverse acceleration, L the dead time of bus and amplifier.
F is a friction with memory on the *commanded* motion, a sum of W_i D_i, where each D_i relaxes to the
direction of motion over a slip distance x_i: dD = (d - D)(1 - exp(-|dx| / x_i)) (Dahl 1968; a bank of them,
as the Maxwell slip elements of Al-Bender et al. 2005). b v* + c a* is what the feedforward of the loop
misses: viscous friction, and half a period in the sum of the velocity error. w is a free waveform that
strokes have learned (`learning.reversal_waveform`), stretched in time so that it covers the same distance at
each acceleration: behind the reversal a is 2 x / t^2 of the way x that the command has come, which is the
reverse acceleration where that stays and follows it where it grows, as after a rest. Below the learned
accelerations w fades, above them it is held.

The command's own derivatives tell when it will turn round: v* + a* t + j* t^2 / 2 = 0. So a feed hold, a stop
or a jog changes the forecast with the command, and nothing needs to know the program.

While it acts, pulse and observer do not: each of them would compensate the same friction once more. It acts
in cst; where the amplifier closes the loops nothing is learned, so that nothing acts.
"""

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from kernels.jit import kernel
from kernels.quantities import Quantity
from kernels.records import Table
from servo_ctrl.control.compensation.trapezoidal_pulse import REST_M
from servo_ctrl.control.limits import clamp
from servo_ctrl.control.section import AxisFacts, Key, LawSection

SLIP_M = (2e-6, 8e-6, 30e-6, 100e-6)
"""Slip distances x_i; chosen: presliding of rolling guides and screws spans 1 to 100 um."""
AHEAD_S = 0.03
"""Before a reversal, from where the waveform acts; chosen: above ten dead times at 1 kHz."""
DEAD_PERIODS = 2.0
"""One until a set point acts, half of holding, half of differencing."""


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
    """Identified friction with memory."""

    level_1_n: float
    """W_1, of the shortest of `SLIP_M`."""
    level_2_n: float
    level_3_n: float
    level_4_n: float
    per_speed_n_s_m: float
    """b, of either sign."""
    per_acceleration_kg: float
    """c, of either sign."""


class Params(NamedTuple):
    """Bounds of the force, and what was learned of it."""

    enabled: bool
    limit_n: Annotated[float, Quantity("N", 0.0, math.inf, "bound of the learned force")]
    lead_s: Annotated[float, Quantity("s", 0.0, math.inf, "dead time L")]
    jerk_m_s3: Annotated[float, Quantity("m/s3", 0.0, math.inf, "bound of the command's jerk")]
    friction: Friction
    waves: Table
    """(m, 1 + n), m >= 1: reverse acceleration m/s^2, rising; then w in newtons, each period from AHEAD_S
    before a reversal on, for one into the positive direction."""


class State(NamedTuple):
    """Where the force is."""

    led_m: float
    """The command at t + L, one sample ago."""
    acceleration_m_s2: float
    """Of the command, one sample ago."""
    turned_m: float
    """The command at the last reversal, between two samples; before the first, where it began."""
    moved_m: float
    """So far has it come since."""
    moved_s: float
    """The time that it took, rests left out; negative before the first reversal."""
    memory_1: float
    """D_1."""
    memory_2: float
    memory_3: float
    memory_4: float


NO_FRICTION = Friction(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
NEUTRAL = Params(
    enabled=False, limit_n=0.0, lead_s=0.0, jerk_m_s3=0.0, friction=NO_FRICTION, waves=np.zeros((1, 2))
)


def params_of(settings: LearnedWaveformSettings, axis: AxisFacts) -> Params:
    """Nothing learned yet, hence off: `config.freeze.with_waveform` puts it in."""
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
    """Before the first motion."""
    return State(
        led_m=position_command_m,
        acceleration_m_s2=0.0,
        turned_m=position_command_m,
        moved_m=0.0,
        moved_s=-1.0,
        memory_1=0.0,
        memory_2=0.0,
        memory_3=0.0,
        memory_4=0.0,
    )


@kernel
def relaxed(memory: float, step_m: float, slip_m: float) -> float:
    """D after a step of the command; rest changes nothing."""
    direction = 1.0 if step_m > 0.0 else -1.0
    return memory + (direction - memory) * -math.expm1(-abs(step_m) / slip_m)


@kernel
def forecast(
    direction: float, velocity_m_s: float, acceleration_m_s2: float, jerk_m_s3: float
) -> tuple[float, float]:
    """Time until a motion in this direction turns round, s (NaN: not foreseen), and its acceleration then."""
    speed_m_s, braking_m_s2, more_m_s3 = (
        direction * velocity_m_s,
        -direction * acceleration_m_s2,
        -direction * jerk_m_s3,
    )
    if speed_m_s < 0.0 < braking_m_s2:  # it has turned round since the last sample
        return speed_m_s / braking_m_s2, braking_m_s2
    square = braking_m_s2 * braking_m_s2 + 2.0 * more_m_s3 * speed_m_s
    if not speed_m_s > 0.0 or not square > 0.0:
        return math.nan, 0.0
    reverse_m_s2 = math.sqrt(square)
    if not braking_m_s2 + reverse_m_s2 > 0.0:
        return math.nan, 0.0
    return 2.0 * speed_m_s / (braking_m_s2 + reverse_m_s2), reverse_m_s2


@kernel
def wave_in_row(
    waves: Table, row: int, led_s: float, reverse_m_s2: float, lead_s: float, period_s: float
) -> float:
    """W of one learned acceleration when the command at the lead is `led_s` behind its reversal; 0 outside.

    Behind the reversal the same distance counts, a t^2 / 2, before it the same time.
    """
    stretch = math.sqrt(reverse_m_s2 / waves[row, 0]) if led_s > 0.0 else 1.0
    # the learner's reversal is the first increment of the new direction: one period late, in the mean
    place = (AHEAD_S - lead_s + led_s * stretch) / period_s - 1.0
    if not 0.0 <= place < waves.shape[1] - 2:
        return 0.0
    column = int(place)
    share = place - column
    return float((1.0 - share) * waves[row, 1 + column] + share * waves[row, 2 + column])


@kernel
def wave_n(waves: Table, led_s: float, reverse_m_s2: float, lead_s: float, period_s: float) -> float:
    """w: between accelerations of the table by their logarithms, held above them, fading to 0 below."""
    last = waves.shape[0] - 1
    if not reverse_m_s2 > 0.0 or not waves[0, 0] > 0.0:
        return 0.0
    fade = min(reverse_m_s2 / waves[0, 0], 1.0)
    within_m_s2 = min(max(reverse_m_s2, waves[0, 0]), waves[last, 0])
    lower = 0
    while lower < last - 1 and waves[lower + 1, 0] <= within_m_s2:
        lower += 1
    upper = min(lower + 1, last)
    share = 0.0
    if waves[upper, 0] > waves[lower, 0]:
        share = math.log(within_m_s2 / waves[lower, 0]) / math.log(waves[upper, 0] / waves[lower, 0])
    one = wave_in_row(waves, lower, led_s, reverse_m_s2, lead_s, period_s)
    other = wave_in_row(waves, upper, led_s, reverse_m_s2, lead_s, period_s)
    return float(fade * ((1.0 - share) * one + share * other))


@kernel
def turned(
    direction: float, position_m: float, velocity_m_s: float, acceleration_m_s2: float, period_s: float
) -> tuple[float, float]:
    """Where and how long ago the command turned round, in the first sample of the new direction."""
    speed_m_s, gain_m_s2 = direction * velocity_m_s, direction * acceleration_m_s2
    ago_s = speed_m_s / gain_m_s2 if speed_m_s > 0.0 and gain_m_s2 > 0.0 else 0.0
    ago_s = min(ago_s, 2.0 * period_s)
    return position_m - direction * 0.5 * gain_m_s2 * ago_s * ago_s, ago_s


@kernel
def planned_force(
    p: Params,
    state: State,
    direction: float,
    age_s: float,
    position_m: float,
    velocity_m_s: float,
    acceleration_m_s2: float,
    period_s: float,
) -> tuple[float, State]:
    """The force, newtons, and the state one period later.

    `direction` of the last motion and `age_s` since its reversal (0 in the sample in which the increment of
    the position command has changed its sign) are the pulse's. Disabled, the memory goes on and the force is
    0.
    """
    jerk_m_s3 = clamp((acceleration_m_s2 - state.acceleration_m_s2) / period_s, p.jerk_m_s3)
    lead_s = p.lead_s
    led_m = position_m + lead_s * (
        velocity_m_s + lead_s * (0.5 * acceleration_m_s2 + lead_s * jerk_m_s3 / 6.0)
    )
    step_m = led_m - state.led_m
    turned_m, moved_s = state.turned_m, state.moved_s
    if age_s == 0.0:
        turned_m, moved_s = turned(direction, position_m, velocity_m_s, acceleration_m_s2, period_s)
    elif moved_s >= 0.0 and abs(direction * (position_m - turned_m) - state.moved_m) >= REST_M:
        moved_s += period_s
    moved_m = direction * (position_m - turned_m)
    now = State(
        led_m=led_m,
        acceleration_m_s2=acceleration_m_s2,
        turned_m=turned_m,
        moved_m=moved_m,
        moved_s=moved_s,
        memory_1=relaxed(state.memory_1, step_m, SLIP_M[0]),
        memory_2=relaxed(state.memory_2, step_m, SLIP_M[1]),
        memory_3=relaxed(state.memory_3, step_m, SLIP_M[2]),
        memory_4=relaxed(state.memory_4, step_m, SLIP_M[3]),
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
    left_s, foreseen_m_s2 = forecast(direction, velocity_m_s, acceleration_m_s2, jerk_m_s3)
    if left_s <= AHEAD_S:
        force_n -= direction * wave_n(p.waves, lead_s - left_s, foreseen_m_s2, lead_s, period_s)
    elif moved_s >= 0.0:
        led_s = moved_s + lead_s
        mean_m_s2 = 2.0 * direction * (led_m - turned_m) / (led_s * led_s)
        force_n += direction * wave_n(p.waves, led_s, mean_m_s2, lead_s, period_s)
    motion_n = friction.per_speed_n_s_m * velocity_m_s + friction.per_acceleration_kg * acceleration_m_s2
    return clamp(force_n, p.limit_n) + clamp(motion_n, p.limit_n), now
