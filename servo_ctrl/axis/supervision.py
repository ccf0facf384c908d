"""Supervision of an axis beside its following error: pure functions, one cycle each.

- Scale and encoder disagree: deviation = motor - correction - scale, both zero where the axis was taken over.
  A broken scale, or a slipped coupling. What stands still cannot be told from what is broken.
- Current saturated: force set point or measured current at its limit for `saturation_cycles` in a row.
- Runs away, led by us: for `runaway_cycles` it is pushed towards its set point with at least `PUSH_SHARE` of
  its force, and over that time gathers speed the other way while its error grows: a wrong sign somewhere.
  That lasts as long as the push, while an impact ends: both halves of the time have to show it.
- Runs away, braked by its drive: it gets faster in two blocks of `runaway_cycles`, one behind the other.

Speeds closer than `velocity_m_s` are equal: an encoder does not resolve them.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from servo_ctrl.canopen.scaling import DriveScaling
from servo_ctrl.config.model import AxisConfig
from servo_ctrl.control.signs import AT_LIMIT, DISAGREE, PUSHED, SupervisionLimits

NOTHING, SATURATED, RUNAWAY = 0, 2, 4
"""Bits of a finding, and `DISAGREE`."""
PUSH_SHARE = 0.25
"""Of the force limit: friction or a process may exceed a smaller push; chosen."""
ERROR_SHARE = 0.02
"""Of the following error limit: a smaller growth of the error may be noise; chosen."""
LIMIT_SHARE = 0.98
"""Share of the limit at which a measured current is at it, as it is rounded, and lags; chosen."""
SPEED_FLOOR_M_S = 2e-3
"""Least difference of two speeds; two counts a period are added to it. Chosen."""


class Counts(NamedTuple):
    """How long the current has been at its limit, and the last cycles in which the axis was pushed."""

    saturated: int
    pushed: tuple[tuple[float, float], ...]
    """Velocity and size of the error, `runaway_cycles` and one at most."""


AT_REST = Counts(0, ())


def saturation_cycles(axis: AxisConfig, period_s: float) -> int:
    """Return how long the current may stay at its limit."""
    return max(math.ceil(axis.limits.saturation_ms * 1e-3 / period_s), 1)


def runaway_cycles(axis: AxisConfig, period_s: float) -> int:
    """Return the length of a block of motion; three cycles have two halves and a cycle between them."""
    return max(math.ceil(axis.limits.runaway_ms * 1e-3 / period_s), 3)


def supervision_limits(axis: AxisConfig, unit: DriveScaling, period_s: float) -> SupervisionLimits:
    """Take the limits of an axis from the machine file."""
    limits = axis.limits
    following_m = limits.following_error_mm * 1e-3
    given_mm = limits.scale_deviation_mm
    return SupervisionLimits(
        deviation_m=0.5 * following_m if given_mm is None else given_mm * 1e-3,
        force_n=limits.force_n,
        current_a=LIMIT_SHARE * limits.force_n / unit.newton_per_ampere,
        push_n=PUSH_SHARE * limits.force_n,
        error_m=ERROR_SHARE * following_m,
        velocity_m_s=SPEED_FLOOR_M_S + 2.0 * unit.metre_per_count / period_s,
        saturation_cycles=saturation_cycles(axis, period_s),
        runaway_cycles=runaway_cycles(axis, period_s),
    )


def supervise(
    limits: SupervisionLimits,
    counts: Counts,
    seen: int,
    push_n: float,
    velocity_m_s: float,
    error_m: float,
) -> tuple[Counts, int]:
    """Judge one cycle of an axis that we lead by what it shows (`control.signs`) and has shown before.

    `push_n`: what pushes the axis, the measured current as a force, or else the set point.
    """
    finding = seen & DISAGREE
    if not seen & (AT_LIMIT | PUSHED):
        return AT_REST, finding
    saturated = counts.saturated + 1 if seen & AT_LIMIT else 0
    if saturated >= limits.saturation_cycles:
        finding |= SATURATED
        saturated = 0
    if not seen & PUSHED:
        return Counts(saturated, ()), finding
    cycles = (*counts.pushed, (velocity_m_s, abs(error_m)))[-limits.runaway_cycles - 1 :]
    if len(cycles) > limits.runaway_cycles and _runs_away(limits, cycles, math.copysign(1.0, push_n)):
        finding |= RUNAWAY
    return Counts(saturated, cycles), finding


def _runs_away(limits: SupervisionLimits, cycles: Sequence[tuple[float, float]], side: float) -> bool:
    """Whether an axis that is pushed to this side goes to the other, ever faster, and from its set point.

    An impact between two samples shows in two differences of velocity. The one between the halves is left
    out, so that no impact is in both of them.
    """
    half = (len(cycles) - 2) // 2
    away_m_s = [-side * velocity_m_s for velocity_m_s, _error_m in cycles]
    return (
        away_m_s[-1] > 0.0
        and away_m_s[half] - away_m_s[0] > limits.velocity_m_s
        and away_m_s[-1] - away_m_s[-1 - half] > limits.velocity_m_s
        and cycles[-1][1] - cycles[0][1] > limits.error_m
    )


class Braking(NamedTuple):
    """Of an axis that its drive brakes: cycles of this block, speed at its begin, blocks it got faster in."""

    cycles: int
    speed_m_s: float
    faster: int


BRAKE_BEGINS = Braking(0, math.inf, 0)


def supervise_braking(
    limits: SupervisionLimits, braking: Braking, velocity_m_s: float
) -> tuple[Braking, bool]:
    """Judge one cycle; True: it does not brake, it runs away."""
    if braking.cycles < limits.runaway_cycles:
        return braking._replace(cycles=braking.cycles + 1), False
    speed_m_s = abs(velocity_m_s)
    faster = braking.faster + 1 if speed_m_s > braking.speed_m_s + limits.velocity_m_s else 0
    return Braking(1, speed_m_s, faster % 2), faster == 2
