"""What an axis is watched for: at the very limit and just beside it, and cycle by cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from servo_ctrl.axis.supervision import (
    AT_REST,
    BRAKE_BEGINS,
    DISAGREE,
    NOTHING,
    RUNAWAY,
    SATURATED,
    Braking,
    Counts,
    SupervisionLimits,
    supervise,
    supervise_braking,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

STEP_M_S, STEP_M = 2.0**-9, 2.0**-16
LIMITS = SupervisionLimits(
    deviation_m=5e-4,
    force_n=600.0,
    current_a=1.0,
    push_n=150.0,
    error_m=STEP_M,
    velocity_m_s=STEP_M_S,
    saturation_cycles=10,
    runaway_cycles=5,
)
"""Of speed and error by powers of two: sums of them are exact."""
FULL, FREE = 600.0, 0.0


def test_findings_can_be_told_from_one_another_however_many_there_are() -> None:
    bits = (DISAGREE, SATURATED, RUNAWAY)
    assert [bit.bit_count() for bit in bits] == [1, 1, 1]
    assert (DISAGREE | SATURATED | RUNAWAY).bit_count() == 3
    assert NOTHING == 0


def findings(
    cycles: Sequence[tuple[float, float, float, float]], limits: SupervisionLimits = LIMITS
) -> list[int]:
    """Of cycles of force set point, push, velocity and error."""
    counts, found = AT_REST, []
    for force_n, push_n, velocity_m_s, error_m in cycles:
        counts, finding = supervise(limits, counts, 0.0, force_n, 0.0, push_n, velocity_m_s, error_m)
        found.append(finding)
    return found


def test_set_point_beyond_its_limit_is_no_less_saturated_than_one_at_it() -> None:
    assert findings([(1.5 * side * FULL, 0.0, 0.0, 0.0) for side in (-1.0, 1.0)] * 5)[-1] == SATURATED


def test_saturation_is_told_anew_for_as_long_as_it_lasts() -> None:
    found = findings([(FULL, 0.0, 0.0, 0.0)] * 25)
    assert [at for at, finding in enumerate(found) if finding] == [9, 19]
    assert set(found) == {NOTHING, SATURATED}


def test_push_goes_on_over_a_break_in_saturation_and_saturation_over_one_in_the_push() -> None:
    pushed = (FREE, 400.0, 0.0, 1e-3)
    both, full = (FULL, *pushed[1:]), (FULL, 0.0, 0.0, 0.0)
    assert findings([both] * 9 + [pushed] + [both] * 9) == [NOTHING] * 19
    assert findings([both] * 9 + [pushed] + [both] * 10)[-1] == SATURATED
    assert findings([both] * 5 + [full] * 5)[-1] == SATURATED
    assert supervise(LIMITS, Counts(3, 4, 0.1, 1e-3), 0.0, FULL, 0.0, 0.0, 0.2, 2e-3) == (
        Counts(4, 0, 0.0, 0.0),
        NOTHING,
    )


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(
    ("push_n", "error_m", "begins"),
    [
        (150.0, 1e-6, True),
        (149.9, 1e-6, False),
        (400.0, 0.0, False),
        (400.0, -1e-6, False),  # away from its set point: that is no push of the loop's
    ],
)
def test_push_counts_from_its_limit_and_towards_the_set_point(
    side: float, push_n: float, error_m: float, begins: bool
) -> None:
    counts, finding = supervise(LIMITS, AT_REST, 0.0, 0.0, 0.0, side * push_n, side * 0.3, side * error_m)
    assert counts == (Counts(0, 1, side * 0.3, error_m) if begins else Counts(0, 0, 0.0, 0.0))
    assert finding == NOTHING


def judged(
    begin: tuple[float, float], end: tuple[float, float], side: float, push_n: float = 400.0
) -> tuple[Counts, int]:
    """A block that has lasted long enough; velocity and error at both ends, both along the push."""
    (from_m_s, from_m), (velocity_m_s, error_m) = begin, end
    before = Counts(0, LIMITS.runaway_cycles, side * from_m_s, from_m)
    return supervise(LIMITS, before, 0.0, 0.0, 0.0, side * push_n, side * velocity_m_s, side * error_m)


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(
    ("to_m_s", "grown_m", "away"),
    [
        (-0.5 - 2 * STEP_M_S, 2 * STEP_M, True),
        (-0.5 - 1.5 * STEP_M_S, 1.5 * STEP_M, True),
        (-0.5 - STEP_M_S, 2 * STEP_M, False),  # what an encoder may take for motion
        (-0.5 - 0.75 * STEP_M_S, 2 * STEP_M, False),
        (-0.5 + 2 * STEP_M_S, 2 * STEP_M, False),
        (-0.5, 2 * STEP_M, False),
        (-0.5 - 2 * STEP_M_S, STEP_M, False),  # what noise may be
        (-0.5 - 2 * STEP_M_S, 0.0, False),  # the set point leads, the axis follows
        (-0.5 - 2 * STEP_M_S, -2 * STEP_M, False),
    ],
)
def test_axis_runs_away_beyond_both_limits_and_not_at_them(
    side: float, to_m_s: float, grown_m: float, away: bool
) -> None:
    error_m = 2.0**-10
    counts, finding = judged((-0.5, error_m), (to_m_s, error_m + grown_m), side)
    assert finding == (RUNAWAY if away else NOTHING)
    assert counts == Counts(0, 1, side * to_m_s, error_m + grown_m)


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("to_m_s", [0.05, 0.0])
def test_axis_that_something_brakes_on_its_way_to_a_set_point_that_leaves_it_is_none(
    side: float, to_m_s: float
) -> None:
    assert judged((0.15, 1e-3), (to_m_s, 2e-3), side)[1] == NOTHING


def test_runaway_and_saturation_are_told_together() -> None:
    before = Counts(LIMITS.saturation_cycles - 1, LIMITS.runaway_cycles, -0.5, 1e-3)
    assert supervise(LIMITS, before, 1e-3, FULL, 0.0, 600.0, -0.6, 2e-3) == (
        Counts(0, 1, -0.6, 2e-3),
        DISAGREE | SATURATED | RUNAWAY,
    )


def test_blocks_follow_one_another_without_a_gap() -> None:
    """A wrong sign from rest: told at the end of each block."""
    found = findings([(FREE, 400.0, -0.01 * k, 1e-3 + 1e-4 * k) for k in range(1, 20)])
    assert [at for at, finding in enumerate(found) if finding] == [5, 10, 15]


def braked(velocities_m_s: Sequence[float], limits: SupervisionLimits = LIMITS) -> list[int]:
    """Cycles in which it is told."""
    braking, told = BRAKE_BEGINS, []
    for at, velocity_m_s in enumerate(velocities_m_s):
        braking, runs_away = supervise_braking(limits, braking, velocity_m_s)
        if runs_away:
            told.append(at)
    return told


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_braked_axis_is_told_when_it_got_faster_in_two_blocks_and_again_two_blocks_later(side: float) -> None:
    assert braked([side * 0.01 * k for k in range(40)]) == [15, 25, 35]


@pytest.mark.parametrize(("gain", "told"), [(0.5, []), (1.0, []), (1.5, [15, 25, 35])])
def test_braked_axis_is_faster_beyond_the_limit_and_not_at_it(gain: float, told: list[int]) -> None:
    assert braked([0.5 + gain * STEP_M_S * (k // 5) for k in range(40)]) == told


def test_blocks_of_a_braked_axis_that_are_not_one_behind_the_other_are_forgotten() -> None:
    """Faster in one block, slower in the next, as by ripple of a stop."""
    assert braked([0.5 if k // 5 % 2 else 0.6 for k in range(60)]) == []
    assert supervise_braking(LIMITS, Braking(5, 0.5, 1), 0.4) == (Braking(1, 0.4, 0), False)


def test_long_times_are_counted_as_short_ones() -> None:
    """Half a second at 1 kHz and above it."""
    long = LIMITS._replace(saturation_cycles=500, runaway_cycles=300)
    full = findings([(FULL, 0.0, 0.0, 0.0)] * 1000, long)
    assert [at for at, finding in enumerate(full) if finding] == [499, 999]
    wrong_sign = findings([(FREE, 400.0, -1e-4 * k, 1e-3 + 1e-6 * k) for k in range(1, 700)], long)
    assert [at for at, finding in enumerate(wrong_sign) if finding] == [300, 600]
    assert braked([1e-4 * k for k in range(1000)], long) == [900]
