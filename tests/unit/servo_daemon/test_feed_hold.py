"""Feed hold on programs of every kind: on the path, within the limits, and with the same end."""

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernels.arrays import Array
from servo_ctrl.axis.servo import REFERENCE_FIELDS
from servo_ctrl.daemon.set_points.feed_hold import FeedHold
from servo_ctrl.daemon.set_points.reference import ProgramReference
from servo_ctrl.motion.circle import Circle
from servo_ctrl.motion.move import Dwell, Move
from servo_ctrl.motion.path.path_move import Element, Line, PathMove
from servo_ctrl.motion.profile import MotionLimits
from servo_ctrl.motion.program import Step, plan_step, segments
from servo_ctrl.motion.samples import Samples
from servo_ctrl.motion.sine import Sine
from servo_ctrl.motion.trapezoidal import ThereAndBack

T = 1e-3
LIMIT_M_S2 = 2.0
FAR = np.full(2, 1.0)
LIMITS = MotionLimits(-FAR, FAR, np.full(2, 0.2), np.full(2, LIMIT_M_S2), np.full(2, 5e3), np.full(2, 100.0))
START_M = np.zeros(2)

CIRCLE = Circle("circle", (0, 1), 0.01, 0.1, 1.5, True, 0.1)
S_CURVE = Move("s", (0.02, -0.01), 0.1, math.inf, trapezoidal=False)
TRAPEZOIDAL = Move("t", (0.02, 0.005), 0.1, math.inf, trapezoidal=True)
CORNERS = PathMove(
    "corners",
    tuple(
        Element(Line(end), 0.05, line, exact_stop=False)
        for line, end in enumerate([(0.01, 0.0), (0.01, 0.008), (0.0, 0.004)], 1)
    ),
    20e-6,
)
TURN = np.linspace(0.0, 2.0 * np.pi, 390)
WAVE_M = np.pad(0.001 * (TURN - np.sin(TURN)), 5, "edge")
RECORDED = Samples(
    "recorded",
    np.column_stack((WAVE_M, np.full(400, np.nan))),
    np.column_stack((np.linspace(0.0, 5.0, 400), np.zeros(400))),
)
PROGRAMS: dict[str, list[Step]] = {
    "circle": [CIRCLE],
    "at the limit": [CIRCLE._replace(feed_m_s=math.sqrt(0.01 * LIMIT_M_S2 * 0.999), ramp_s=0.4)],
    "s curve": [S_CURVE],
    "trapezoidal": [TRAPEZOIDAL],
    "corners": [CORNERS],
    "sine": [Sine("sine", 0, 0.004, 16.0, 2.0, 0.05)],
    "there and back": [ThereAndBack("b", 1, 0.01, 0.08, 1.9, 2)],
    "recorded": [RECORDED],
    "several": [TRAPEZOIDAL, Dwell("rest", 0.02), CIRCLE._replace(turns=0.4)],
}


class Run(NamedTuple):
    """Each array is (n, 2); the first row is the start."""

    position_m: Array
    velocity_m_s: Array
    acceleration_m_s2: Array
    force_n: Array
    program: FeedHold


def run(steps: Sequence[Step], switches: Iterable[tuple[int, bool]] = (), chunk: int = 64) -> Run:
    """The program with a hold (True) or resumption (False) before these cycles; resumed after the last."""
    program = FeedHold(
        ProgramReference(segments(steps, START_M, LIMITS, T, chunk)), LIMITS.acceleration_m_s2, T
    )
    wanted, rows, cycle = dict(switches), [[x for m in START_M for x in (m, 0.0, 0.0, 0.0)]], 0
    last = max(wanted, default=0)
    while True:
        if cycle in wanted or cycle == last + 1:
            program.holding = bool(wanted.get(cycle))
        row = program.advance(cycle)
        if row is None:
            break
        rows.append(row)
        cycle += 1
        assert cycle < 20_000
    table = np.array(rows).reshape(len(rows), 2, REFERENCE_FIELDS)
    return Run(*(table[:, :, field] for field in range(REFERENCE_FIELDS)), program)


def distance_to_path_m(position_m: Array, steps: Sequence[Step]) -> float:
    """The largest distance of points to the polyline through the programmed motion, finely drawn."""
    drawn, start_m = [START_M[np.newaxis]], START_M
    for step in steps:
        profile = plan_step(step, start_m, LIMITS, T)
        start_m = profile.end_m
        drawn.append(profile.at(np.arange(0.0, profile.duration_s, T / 8.0)).position_m)
        drawn.append(start_m[np.newaxis])
    path = np.concatenate(drawn)
    start, way = path[:-1], np.diff(path, axis=0)
    length = np.maximum((way**2).sum(axis=1), 1e-30)
    worst = 0.0
    for point in position_m:
        share = np.clip(((point - start) * way).sum(axis=1) / length, 0.0, 1.0)
        worst = max(worst, float(np.hypot(*(start + share[:, np.newaxis] * way - point).T).min()))
    return worst


def beyond_limit(made: Run) -> float:
    """The largest acceleration as a share of the limit: as commanded, and from sample to sample."""
    changes = np.diff(made.velocity_m_s, axis=0) / T
    return max(np.abs(made.acceleration_m_s2).max(), np.abs(changes).max()) / LIMIT_M_S2


def test_program_that_is_not_held_is_given_out_as_it_is() -> None:
    for steps in PROGRAMS.values():
        plain = ProgramReference(segments(steps, START_M, LIMITS, T, 64))
        held = run(steps)
        for cycle, position_m in enumerate(held.position_m[1:]):
            row = plain.advance(cycle)
            assert row is not None
            assert row[::REFERENCE_FIELDS] == position_m.tolist()
        assert plain.advance(0) is None
        assert held.program.spans == plain.spans


switching = st.lists(st.integers(0, 900), min_size=1, max_size=5, unique=True).map(
    lambda cycles: [(cycle, place % 2 == 0) for place, cycle in enumerate(sorted(cycles))]
)


@pytest.mark.parametrize("name", PROGRAMS)
@settings(max_examples=8, deadline=None)
@given(switches=switching)
def test_held_program_keeps_to_its_path_its_limits_and_its_end(
    name: str, switches: list[tuple[int, bool]]
) -> None:
    steps = PROGRAMS[name]
    plain, made = run(steps), run(steps, switches)
    assert made.position_m[-1].tolist() == plain.position_m[-1].tolist()
    assert len(made.position_m) >= len(plain.position_m)
    assert made.program.ended
    assert not made.velocity_m_s[-1].any()
    # a recorded reference is what lies between its samples: its program needs as much as it needs
    allowed = max(beyond_limit(plain), 1.0)
    assert beyond_limit(made) <= allowed * (1.0 + 1e-6)
    # the velocity is that of the positions
    mean_m_s = 0.5 * (made.velocity_m_s[1:] + made.velocity_m_s[:-1])
    assert np.abs(np.diff(made.position_m, axis=0) / T - mean_m_s).max() <= 0.5 * LIMIT_M_S2 * T
    if name != "recorded":
        assert distance_to_path_m(made.position_m[:: max(len(made.position_m) // 100, 1)], steps) < 1e-8


@pytest.mark.parametrize("name", ["circle", "s curve", "corners", "recorded"])
def test_held_program_stands_still_until_it_is_resumed(name: str) -> None:
    made = run(PROGRAMS[name], [(80, True), (700, False)])
    still = slice(400, 700)
    assert (made.position_m[still] == made.position_m[400]).all()
    assert not made.velocity_m_s[still].any()
    assert not made.acceleration_m_s2[still].any()
    assert not (made.position_m[701:705] == made.position_m[400]).all()


def test_points_of_a_held_circle_have_its_radius() -> None:
    made = run([CIRCLE], [(300, True), (500, False), (620, True), (621, False)])
    radius_m = np.hypot(made.position_m[:, 0] + CIRCLE.radius_m, made.position_m[:, 1])
    assert np.abs(radius_m - CIRCLE.radius_m).max() < 1e-15


def test_hold_takes_hardly_longer_than_the_limits_ask_for() -> None:
    """On a straight move at constant speed: v / a of the axis that is limited, and half of v^2 / a."""
    step = Move("t", (0.1, 0.0), 0.1, math.inf, trapezoidal=True)
    made = run([step], [(200, True), (500, False)])
    braking = np.flatnonzero(made.velocity_m_s[200:500, 0])[-1]
    assert braking == pytest.approx(0.1 / LIMIT_M_S2 / T, rel=0.15)
    way_m = made.position_m[500, 0] - made.position_m[200, 0]
    assert way_m == pytest.approx(0.5 * 0.1**2 / LIMIT_M_S2, rel=0.15)


def test_force_offset_belongs_to_the_place_on_the_path() -> None:
    made = run([RECORDED], [(100, True), (300, False)])
    plain = run([RECORDED])
    moving = slice(20, 380)
    expected = np.interp(made.position_m[:, 0], plain.position_m[moving, 0], plain.force_n[moving, 0])
    moving = (made.position_m[:, 0] > 1e-4) & (made.position_m[:, 0] < WAVE_M[-1] - 1e-4)
    assert np.count_nonzero(moving) > 400
    assert np.abs(made.force_n[:, 0] - expected)[moving].max() < 2e-3


def test_spans_list_the_cycles_of_each_step_and_no_constant_speed_around_a_hold() -> None:
    made = run([CIRCLE, Dwell("rest", 0.02), CIRCLE], [(400, True), (600, False)])
    first, rest, second = made.program.spans
    assert first.last_cycle > 150 + run([CIRCLE]).program.spans[0].last_cycle
    assert (first.steady_first_cycle, first.steady_last_cycle) == (0, -1)
    assert second.steady_last_cycle > second.steady_first_cycle > first.last_cycle
    for before, after in pairwise((first, rest, second)):
        assert after.first_cycle == before.last_cycle + 1
    assert second.last_cycle == len(made.position_m) - 2


def test_progress_does_not_count_the_hold() -> None:
    held, plain = run([CIRCLE], [(300, True), (500, False)]), run([CIRCLE])
    assert held.program.program.samples == plain.program.program.samples
