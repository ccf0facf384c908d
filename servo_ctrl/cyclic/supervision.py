"""Supervision of an axis beside its following error: pure functions, one cycle each.

- Scale and encoder disagree: deviation = motor - correction - scale, both zero where the axis was taken over.
  A broken scale, or a slipped coupling. At rest a broken scale looks like a good one.
- Current saturated: force set point or measured current at its limit for `saturation_cycles` in a row.
- Runs away, led by us: for `runaway_cycles` it is pushed towards its set point with at least `push_n`, and
  over that time gathers speed the other way while its error grows: a wrong sign somewhere. That lasts as long
  as the push, while an impact ends: both halves of the time have to show it.
- Runs away, braked by its drive: it gets faster in two blocks of `runaway_cycles`, one behind the other.

Speeds closer than `velocity_m_s` are equal: an encoder does not resolve them.
"""

import math
from typing import Any, NamedTuple

from kernels.arrays import Array
from kernels.jit import kernel
from servo_ctrl.control.signs import AT_LIMIT, DISAGREE, PUSHED, SupervisionLimits

NOTHING, SATURATED, RUNAWAY = 0, 2, 4
"""Bits of a finding, and `DISAGREE`."""


class Counts(NamedTuple):
    """How long the current has been at its limit, and the last cycles in which the axis was pushed."""

    saturated: int
    pushed: int
    """How many of them are kept, `runaway_cycles` and one at most."""
    next: int
    """Place of the next one."""


class Braking(NamedTuple):
    """Of an axis that its drive brakes: cycles of this block, speed at its begin, blocks it got faster in."""

    cycles: int
    speed_m_s: float
    faster: int


AT_REST = Counts(0, 0, 0)
BRAKE_BEGINS = Braking(0, math.inf, 0)


@kernel
def supervise(
    limits: SupervisionLimits,
    counts: Counts,
    kept: Array,
    seen: int,
    push_n: float,
    velocity_m_s: float,
    error_m: float,
) -> tuple[Counts, int]:
    """Judge one cycle of an axis that we lead by what it shows (`control.signs`) and has shown before.

    `kept` (`runaway_cycles` + 1 or more, 2): velocity and size of the error in the cycles that it was pushed;
    `push_n`: what pushes the axis, the measured current as a force, or else the set point.
    """
    finding = seen & DISAGREE
    saturated = counts.saturated + 1 if seen & AT_LIMIT else 0
    if saturated >= limits.saturation_cycles:
        finding |= SATURATED
        saturated = 0
    if not seen & PUSHED:
        return Counts(saturated, 0, 0), finding
    cycles = limits.runaway_cycles + 1
    kept[counts.next, 0], kept[counts.next, 1] = velocity_m_s, abs(error_m)
    following = (counts.next + 1) % cycles
    pushed = min(counts.pushed + 1, cycles)
    if pushed == cycles and runs_away(limits, kept, following, math.copysign(1.0, push_n)):
        finding |= RUNAWAY
    return Counts(saturated, pushed, following), finding


@kernel
def runs_away(limits: SupervisionLimits, kept: Array, first: int, side: float) -> bool:
    """Whether an axis that is pushed to this side goes to the other, ever faster, and from its set point.

    `first`: place of the oldest cycle. An impact between two samples shows in two differences of velocity.
    The one between the halves is left out, so that no impact is in both of them.
    """
    cycles = limits.runaway_cycles + 1
    half, last = (cycles - 2) // 2, (first + cycles - 1) % cycles
    begins, begun = kept[first, 0], kept[(first + half) % cycles, 0]
    goes_on, ends = kept[(first + cycles - 1 - half) % cycles, 0], kept[last, 0]
    away: bool = (
        -side * ends > 0.0
        and -side * begun - -side * begins > limits.velocity_m_s
        and -side * ends - -side * goes_on > limits.velocity_m_s
        and kept[last, 1] - kept[first, 1] > limits.error_m
    )
    return away


@kernel
def supervise_braking(limits: Any, braking: Braking, velocity_m_s: float) -> tuple[Braking, bool]:
    """Judge one cycle; True: it does not brake, it runs away."""
    if braking.cycles < limits.runaway_cycles:
        return Braking(braking.cycles + 1, braking.speed_m_s, braking.faster), False
    speed_m_s = abs(velocity_m_s)
    faster = braking.faster + 1 if speed_m_s > braking.speed_m_s + limits.velocity_m_s else 0
    return Braking(1, speed_m_s, faster % 2), faster == 2
