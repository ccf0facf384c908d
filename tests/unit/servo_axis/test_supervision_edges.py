"""What an axis is watched for: at the very limit and just beside it, and cycle by cycle."""

from collections.abc import Sequence

import pytest
from supervised_cycle import AT_REST, Counts, supervise

from servo_ctrl.control.signs import DISAGREE, SupervisionLimits
from servo_ctrl.cyclic.supervision import (
    BRAKE_BEGINS,
    NOTHING,
    RUNAWAY,
    SATURATED,
    Braking,
    supervise_braking,
)

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


def test_findings_stay_distinct_in_any_number() -> None:
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


def test_saturation_is_reported_repeatedly_while_it_lasts() -> None:
    found = findings([(FULL, 0.0, 0.0, 0.0)] * 25)
    assert [at for at, finding in enumerate(found) if finding] == [9, 19]
    assert set(found) == {NOTHING, SATURATED}


def test_push_and_saturation_are_counted_independently() -> None:
    pushed = (FREE, 400.0, 0.0, 1e-3)
    both, full = (FULL, *pushed[1:]), (FULL, 0.0, 0.0, 0.0)
    assert findings([both] * 9 + [pushed] + [both] * 9) == [NOTHING] * 19
    assert findings([both] * 9 + [pushed] + [both] * 10)[-1] == SATURATED
    assert findings([both] * 5 + [full] * 5)[-1] == SATURATED
    assert supervise(LIMITS, Counts(3, ((0.1, 1e-3),)), 0.0, FULL, 0.0, 0.0, 0.2, 2e-3) == (
        Counts(4, ()),
        NOTHING,
    )


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(
    ("push_n", "error_m", "begins"),
    [
        (150.0, 1e-6, True),
        (149.9, 1e-6, False),
        (400.0, 0.0, False),
        (400.0, -1e-6, False),  # away from its set point: that is not a push of the loop's
    ],
)
def test_push_counts_from_its_limit_and_towards_the_set_point(
    side: float, push_n: float, error_m: float, begins: bool
) -> None:
    counts, finding = supervise(LIMITS, AT_REST, 0.0, 0.0, 0.0, side * push_n, side * 0.3, side * error_m)
    assert counts == Counts(0, ((side * 0.3, abs(error_m)),) if begins else ())
    assert finding == NOTHING


STEADY = (-0.5, -0.5, -0.5, -0.5, -0.5, -0.5)
"""Velocities along the push, of a block and the cycle before it: away at constant speed."""


def judged(
    velocities_m_s: Sequence[float], grown_m: float, side: float = 1.0, limits: SupervisionLimits = LIMITS
) -> int:
    """The finding in the last of these cycles; the error has grown in the last two."""
    errors_m = [2.0**-10] * (len(velocities_m_s) - 1) + [2.0**-10 + grown_m]
    return findings(
        [
            (FREE, side * 400.0, side * velocity_m_s, side * error_m)
            for velocity_m_s, error_m in zip(velocities_m_s, errors_m, strict=True)
        ],
        limits,
    )[-1]


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(
    ("first", "last", "grown", "away"),
    [
        (2, 2, 2, True),
        (1.5, 1.5, 1.5, True),
        (1, 2, 2, False),  # what an encoder may take for motion
        (2, 1, 2, False),
        (0, 4, 2, False),  # it has just begun: a blow looks like that
        (4, 0, 2, False),  # it has ended
        (4, -2, 2, False),
        (-2, 4, 2, False),
        (2, 2, 1, False),  # what noise may be
        (2, 2, 0, False),  # the set point leads, the axis follows
        (2, 2, -2, False),
    ],
)
def test_axis_runs_away_beyond_all_limits_in_both_halves_and_not_at_them(
    side: float, first: float, last: float, grown: float, away: bool
) -> None:
    from_m_s, behind_m_s = -0.5, -0.5 - first * STEP_M_S
    half = (from_m_s + 9.0, behind_m_s)  # what is between begin and end of a half does not count
    velocities_m_s = (from_m_s, *half, behind_m_s, behind_m_s + 9.0, behind_m_s - last * STEP_M_S)
    assert judged(velocities_m_s, grown * STEP_M, side) == (RUNAWAY if away else NOTHING)


@pytest.mark.parametrize("at", range(1, 6))
@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 1.0])
def test_short_disturbance_lies_in_one_half_only_at_any_time(at: int, share: float) -> None:
    """It falls between two samples: a share of it shows in one cycle, all of it from the next on."""
    knocked = [v - (0.0 if k < at else 0.2 * share if k == at else 0.2) for k, v in enumerate(STEADY)]
    assert judged(knocked, 1e-3) == NOTHING


@pytest.mark.parametrize("left_out_m_s", [(), (9.0,)])
def test_halves_of_the_shortest_blocks_are_a_cycle_each(left_out_m_s: tuple[float, ...]) -> None:
    rise = (-0.5, -0.5 - 2 * STEP_M_S, *left_out_m_s, -0.4, -0.4 - 2 * STEP_M_S)
    limits = LIMITS._replace(runaway_cycles=len(rise) - 1)
    assert judged(rise, 1e-3, limits=limits) == RUNAWAY
    assert judged((-0.5, *rise[1:-1], -0.4), 1e-3, limits=limits) == NOTHING
    assert judged((-0.6, *rise[1:]), 1e-3, limits=limits) == NOTHING


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(("to_m_s", "away"), [(0.05, False), (0.0, False), (-STEP_M_S, True)])
def test_axis_braked_externally_is_a_runaway_only_if_it_moves_away_from_its_set_point(
    side: float, to_m_s: float, away: bool
) -> None:
    slower = [to_m_s + 0.02 * left for left in range(5, -1, -1)]
    assert judged(slower, 1e-3, side) == (RUNAWAY if away else NOTHING)


def test_runaway_and_saturation_are_reported_together() -> None:
    cycles = [(-0.1 * k, 1e-3 + 1e-4 * k) for k in range(1, 7)]
    before = Counts(LIMITS.saturation_cycles - 1, tuple(cycles[:-1]))
    velocity_m_s, error_m = cycles[-1]
    counts, finding = supervise(LIMITS, before, 1e-3, FULL, 0.0, 600.0, velocity_m_s, error_m)
    assert counts == Counts(0, tuple(cycles))
    assert finding == DISAGREE | SATURATED | RUNAWAY


def test_wrong_sign_from_standstill_is_reported_a_block_later_while_it_lasts() -> None:
    found = findings([(FREE, 400.0, -0.01 * k, 1e-3 + 1e-4 * k) for k in range(20)])
    assert [at for at, finding in enumerate(found) if finding] == list(range(5, 20))


@pytest.mark.parametrize(("grows_at", "away"), [(0, False), (1, True), (5, True), (6, False)])
def test_error_may_have_grown_at_any_time_of_the_block(grows_at: int, away: bool) -> None:
    cycles = [(FREE, 400.0, -0.01 * k, 1e-3 if k < grows_at else 2e-3) for k in range(6)]
    assert findings(cycles)[-1] == (RUNAWAY if away else NOTHING)


def test_only_the_last_block_counts() -> None:
    """Fast once, then at constant speed: what was before is forgotten."""
    counts = AT_REST
    for k in range(20):
        counts, _finding = supervise(LIMITS, counts, 0.0, FREE, 0.0, 400.0, -0.01 * k, 1e-3)
        assert counts.pushed == tuple((-0.01 * at, 1e-3) for at in range(max(k - 5, 0), k + 1))


def braked(velocities_m_s: Sequence[float], limits: SupervisionLimits = LIMITS) -> list[int]:
    """Cycles in which it is reported."""
    braking, reported = BRAKE_BEGINS, []
    for at, velocity_m_s in enumerate(velocities_m_s):
        braking, runs_away = supervise_braking(limits, braking, velocity_m_s)
        if runs_away:
            reported.append(at)
    return reported


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_braked_axis_is_reported_when_faster_in_two_blocks_and_again_two_blocks_later(side: float) -> None:
    assert braked([side * 0.01 * k for k in range(40)]) == [15, 25, 35]


@pytest.mark.parametrize(("gain", "reported"), [(0.5, []), (1.0, []), (1.5, [15, 25, 35])])
def test_braked_axis_is_faster_beyond_the_limit_and_not_at_it(gain: float, reported: list[int]) -> None:
    assert braked([0.5 + gain * STEP_M_S * (k // 5) for k in range(40)]) == reported


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
    assert [at for at, finding in enumerate(wrong_sign) if finding] == list(range(300, 699))
    assert braked([1e-4 * k for k in range(1000)], long) == [900]
