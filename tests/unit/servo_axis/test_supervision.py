"""Supervision of an axis, against motions whose forces are known in closed form."""

import math
from collections.abc import Iterable
from typing import NamedTuple

import pytest
from supervised_cycle import AT_REST, supervise

from servo_ctrl.control.signs import DISAGREE, SupervisionLimits
from servo_ctrl.cyclic.supervision import BRAKE_BEGINS, NOTHING, RUNAWAY, SATURATED, supervise_braking

PERIOD_S, MASS_KG = 1e-3, 70.0
LIMITS = SupervisionLimits(
    deviation_m=5e-4,
    force_n=600.0,
    current_a=1.0,
    push_n=150.0,
    error_m=2e-5,
    velocity_m_s=2e-3,
    saturation_cycles=10,
    runaway_cycles=5,
)


class Seen(NamedTuple):
    """What `supervise` is given of a cycle."""

    deviation_m: float
    force_n: float
    current_a: float
    push_n: float
    velocity_m_s: float
    error_m: float


STILL = Seen(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def found(cycles: Iterable[Seen]) -> list[int]:
    """The finding of each cycle."""
    counts, findings = AT_REST, []
    for seen in cycles:
        counts, finding = supervise(LIMITS, counts, *seen)
        findings.append(finding)
    return findings


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_sensors_that_drift_apart_are_found_beyond_the_limit_and_not_before(side: float) -> None:
    drift = [STILL._replace(deviation_m=side * k * 1e-5) for k in range(60)]
    assert found(drift) == [NOTHING] * 51 + [DISAGREE] * 9


def test_axis_without_a_scale_is_not_judged_by_it() -> None:
    assert found([STILL._replace(deviation_m=math.nan)]) == [NOTHING]


@pytest.mark.parametrize("at_limit", [{"force_n": -600.0}, {"current_a": 1.1}, {"current_a": -1.0}])
def test_saturation_counts_only_uninterrupted(at_limit: dict[str, float]) -> None:
    full = STILL._replace(**at_limit)
    assert found([full] * 9 + [STILL] + [full] * 9) == [NOTHING] * 19
    assert found([full] * 10)[-1] == SATURATED


def pushed_axis(force_n: float, acceleration_m_s2: float, from_m_s: float, cycles: int = 30) -> list[Seen]:
    """A set point at rest at 0, an axis under constant acceleration, and a push towards the set point."""
    seen = []
    for k in range(1, cycles):
        t = k * PERIOD_S
        at_m = -math.copysign(1e-4, force_n) + from_m_s * t + 0.5 * acceleration_m_s2 * t * t
        velocity_m_s = from_m_s + acceleration_m_s2 * t
        seen.append(Seen(0.0, 0.0, math.nan, force_n, velocity_m_s, -at_m))
    return seen


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_wrong_sign_is_found_within_a_block_and_a_cycle(side: float) -> None:
    """F = 400 N drives 70 kg the other way: 5.7 m/s^2 against the push, 80 um in the first 5 ms."""
    findings = found(pushed_axis(side * 400.0, -side * 400.0 / MASS_KG, 0.0))
    assert RUNAWAY in findings[: LIMITS.runaway_cycles + 1]


@pytest.mark.parametrize(
    ("force_n", "acceleration_m_s2", "from_m_s"),
    [
        (400.0, 400.0 / MASS_KG, 0.0),  # it goes where it is pushed
        (400.0, 0.0, 0.0),  # it sticks
        (400.0, 400.0 / MASS_KG, -0.15),  # it comes back from an overshoot
        (400.0, 0.0, -0.05),  # a process drags it along at constant speed
        (400.0, -2.0, 0.15),  # friction brakes it although it is pushed
        (100.0, -5.0, 0.0),  # hardly pushed: a process may be stronger
    ],
)
def test_ordinary_motion_is_no_runaway(force_n: float, acceleration_m_s2: float, from_m_s: float) -> None:
    assert not any(finding & RUNAWAY for finding in found(pushed_axis(force_n, acceleration_m_s2, from_m_s)))


def struck_axis(at_s: float, lasts_s: float, cycles: int = 25) -> list[Seen]:
    """Pushed with 160 N as in a ramp down; then a blow of 0.23 m/s, and 600 N against it."""
    blow_m_s2 = 0.23 / lasts_s
    seen, before_m = [], 0.0
    for k in range(1, cycles):
        t = k * PERIOD_S
        struck_s = max(t - at_s, 0.0)
        free_s = max(struck_s - lasts_s, 0.0)
        at_m = -1e-4 - 0.05 * t + 0.5 * (160.0 / MASS_KG) * t * t + 0.5 * (440.0 / MASS_KG) * struck_s**2
        at_m -= 0.5 * blow_m_s2 * (struck_s**2 - free_s**2)
        push_n = 600.0 if struck_s else 160.0
        seen.append(Seen(0.0, 0.0, math.nan, push_n, (at_m - before_m) / PERIOD_S, 1e-3 - at_m))
        before_m = at_m
    return seen[1:]


@pytest.mark.parametrize("phase", range(10))
@pytest.mark.parametrize("cycle", range(2, 12))
def test_short_disturbance_is_no_runaway_at_any_time(cycle: int, phase: int) -> None:
    findings = found(struck_axis((cycle + 0.1 * phase) * PERIOD_S, 1e-5))
    assert not any(finding & RUNAWAY for finding in findings)


def test_disturbance_beyond_the_drive_force_for_a_block_is_a_runaway() -> None:
    """It cannot be distinguished from a wrong sign, and power is not an answer to it."""
    lasting_s = (LIMITS.runaway_cycles + 1) * PERIOD_S
    assert RUNAWAY in found(struck_axis(7.3 * PERIOD_S, lasting_s))


def braked(velocities_m_s: Iterable[float]) -> list[bool]:
    braking, verdicts = BRAKE_BEGINS, []
    for velocity_m_s in velocities_m_s:
        braking, runs_away = supervise_braking(LIMITS, braking, velocity_m_s)
        verdicts.append(runs_away)
    return verdicts


def test_braking_with_ringing_is_no_finding() -> None:
    ramp = [max(0.2 - 2.0 * k * PERIOD_S, 0.0) for k in range(200)]
    ringing = [1e-3 * math.sin(k) for k in range(200)]
    assert not any(braked(ramp + ringing))


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_axis_that_accelerates_under_braking_is_reported_within_three_blocks(side: float) -> None:
    verdicts = braked(side * (0.05 + 2.0 * k * PERIOD_S) for k in range(40))
    assert True in verdicts[: 3 * LIMITS.runaway_cycles + 1]


def test_axis_that_reverses_under_braking_is_reported() -> None:
    verdicts = braked(0.02 - 2.0 * k * PERIOD_S for k in range(40))
    assert True in verdicts
