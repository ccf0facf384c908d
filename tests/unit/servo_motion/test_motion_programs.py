"""Programs: joints, sampling, laziness, and the check against the limits."""

import itertools
import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from servo_ctrl.motion.circle import Circle
from servo_ctrl.motion.move import Dwell, Move
from servo_ctrl.motion.profile import MotionLimits
from servo_ctrl.motion.program import Segment, Step, segments
from servo_ctrl.motion.samples import Samples
from servo_ctrl.motion.sine import Sine
from servo_ctrl.motion.trapezoidal import ThereAndBack
from servo_ctrl.motion.violation import first_violation, stop_at_the_end

T = 1e-3
START = np.zeros(2)
LIMITS = MotionLimits(
    position_min_m=np.array([-0.1, -0.2]),
    position_max_m=np.array([0.1, 0.2]),
    velocity_m_s=np.array([0.2, 0.1]),
    acceleration_m_s2=np.array([2.0, 1.0]),
    jerk_m_s3=np.array([50.0, 100.0]),
    force_n=np.array([600.0, 600.0]),
)
STILL = float("nan")


def whole(steps: Sequence[Step], **options: int) -> list[Segment]:
    return list(segments(steps, START, LIMITS, T, **options))


def joined(program: Sequence[Segment]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return (
        np.concatenate([segment.position_m for segment in program]),
        np.concatenate([segment.velocity_m_s for segment in program]),
    )


def move(x: float, y: float = STILL, *, feed: float = 0.05, trapezoidal: bool = False) -> Move:
    return Move("m", (x, y), feed, math.inf, trapezoidal)


steps_of_all_kinds: st.SearchStrategy[Step] = st.one_of(
    st.builds(
        Move,
        st.just("m"),
        st.tuples(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05)),
        st.floats(1e-3, 0.1),
        st.just(math.inf),
        st.booleans(),
    ),
    st.builds(Dwell, st.just("d"), st.floats(1e-4, 0.1)),
    st.builds(lambda a: Sine("s", 1, a, 2.0, 0.5, 0.5), st.floats(1e-4, 0.02)),
    st.builds(lambda r: Circle("c", (0, 1), r, 2.0 * r, 0.5, True, 0.5), st.floats(1e-3, 0.01)),
    st.builds(lambda d: ThereAndBack("t", 0, d, 0.02, 0.02, 1), st.floats(1e-3, 0.02)),
)


@given(st.lists(steps_of_all_kinds, min_size=1, max_size=6))
@example([Move("m", (0.03125, 2.2e-311), 0.0625, math.inf, False)])
@settings(deadline=None, max_examples=40)
def test_any_program_of_moderate_steps_is_continuous_and_within_the_limits(steps: list[Step]) -> None:
    roomy = LIMITS._replace(position_min_m=np.full(2, -1.0), position_max_m=np.full(2, 1.0))
    assert first_violation(segments(steps, START, roomy, T), START, roomy, T) is None


def test_a_step_starts_where_the_one_before_ended_and_ends_exactly() -> None:
    program = whole([move(0.0123, 0.0077), Dwell("d", 0.0105), move(-0.01)])
    x, v = joined(program)
    assert tuple(program[0].position_m[-1]) == (0.0123, 0.0077)
    assert len(program[1].position_m) == 11
    assert tuple(program[2].position_m[-1]) == (-0.01, 0.0077)
    assert not v[[len(program[0].position_m) - 1, -1]].any()
    assert np.abs(np.diff(x, axis=0, prepend=START[np.newaxis])).max() <= 0.05 * T * (1 + 1e-9)


def test_a_program_in_short_segments_is_the_same_program() -> None:
    steps = [Circle("c", (0, 1), 0.025, 0.05, 1.3, True, 0.5), move(0.0, 0.0)]
    long, short = whole(steps), whole(steps, segment_samples=100)
    for a, b in zip(joined(long), joined(short), strict=True):
        np.testing.assert_array_equal(a, b)
    assert [s.step for s in long] == [0, 1]
    assert all(len(segment.position_m) <= 100 for segment in short)
    steady = {s.first_sample + row for s in short if s.step == 0 for row in range(*s.steady)}
    assert steady == set(range(*long[0].steady))


def test_steady_rows_run_at_the_feed_and_the_rows_beside_them_do_not() -> None:
    (segment,) = whole([Circle("c", (0, 1), 0.025, 0.05, 1.3, True, 0.5)])
    start, stop = segment.steady
    speed = np.hypot(*segment.velocity_m_s.T)
    np.testing.assert_allclose(speed[start:stop], 0.05, rtol=1e-12)
    assert speed[start - 1] < 0.05
    assert speed[stop] < 0.05


def test_a_long_program_is_compiled_as_it_is_run() -> None:
    endless = (Dwell("d", 1e9) for _ in itertools.count())
    program = segments(endless, START, LIMITS, T, segment_samples=1000)
    for segment in itertools.islice(program, 5):
        assert len(segment.position_m) == 1000
    assert segment.first_sample == 4000


def test_a_move_is_as_fast_as_the_axis_that_is_nearest_its_limit() -> None:
    # along 45 degrees: the path may have sqrt(2) times the lower acceleration limit, 1 m/s^2 of y
    (segment,) = whole([move(0.05, 0.05, feed=0.1)])
    top = np.abs(segment.acceleration_m_s2).max(axis=0)
    assert first_violation([segment], START, LIMITS, T) is None
    assert top.max() > 0.9 * min(1.0, math.sqrt(0.1 / math.sqrt(2) * 50.0))


def test_axes_without_a_target_stay() -> None:
    program = whole([move(0.01, 0.02), move(STILL, 0.0)])
    assert (program[1].position_m[:, 0] == 0.01).all()


@pytest.mark.parametrize(
    ("step", "axis", "quantity", "value", "limit"),
    [
        (move(0.11), 0, "position", 0.11, 0.1),
        (move(0.0, -0.25), 1, "position", 0.25, 0.2),
        (move(0.1, feed=0.25), 0, "velocity", 0.25, 0.2),
        (Sine("s", 1, 0.01, 20.0, 9.0, 0.3), 1, "velocity", 0.2, 0.1),
        (Sine("s", 0, 0.002, 40.0, 9.0, 0.3), 0, "acceleration", 3.2, 2.0),
        (ThereAndBack("t", 0, 0.02, 0.02, 0.1, 1), 0, "jerk", 100.0, 50.0),
        (Circle("c", (0, 1), 0.06, 0.01, 1.0, True, 0.5), 0, "position", 0.12, 0.1),
        (Samples("r", np.zeros((9, 2)), np.full((9, 2), 700.0)), 0, "force offset", 700.0, 600.0),
    ],
)
def test_a_step_beyond_a_limit_is_named(
    step: Step, axis: int, quantity: str, value: float, limit: float
) -> None:
    violation = first_violation(segments([Dwell("d", 0.1), step], START, LIMITS, T), START, LIMITS, T)
    assert violation is not None
    assert (violation.step, violation.label, violation.axis) == (1, step.label, axis)
    assert violation.quantity == quantity
    assert abs(violation.value) == pytest.approx(value, rel=1e-3)
    assert violation.limit == math.copysign(limit, violation.value)


def test_a_reference_that_jumps_is_refused() -> None:
    recorded = np.zeros((100, 2))
    recorded[50:, 0] = 1e-3  # 1 mm within a period is 1 m/s
    violation = first_violation(
        segments([Samples("r", recorded, np.zeros((100, 2)))], START, LIMITS, T), START, LIMITS, T
    )
    assert violation is not None
    assert violation.quantity == "velocity"
    assert violation.time_s == pytest.approx(0.051, abs=0.0011)


def test_a_reference_that_starts_elsewhere_is_refused() -> None:
    recorded = np.full((100, 2), 0.05)
    (segment,) = whole([Samples("r", recorded, np.zeros((100, 2)))])
    violation = first_violation([segment], START, LIMITS, T)
    assert violation is not None
    assert (violation.quantity, violation.time_s) == ("velocity", T)
    assert first_violation([segment], np.full(2, 0.05), LIMITS, T) is None


def test_a_program_that_ends_in_motion_is_refused() -> None:
    t = np.arange(1, 101) * T
    speeding_up = np.column_stack((0.5 * t**2, np.zeros(100)))  # 1 m/s^2, 0.1 m/s at the end
    (segment,) = whole([Samples("r", speeding_up, np.zeros((100, 2)))])
    limits = LIMITS._replace(jerk_m_s3=np.full(2, 2000.0))
    assert first_violation([segment], START, limits, T) is None
    violation = first_violation([segment, stop_at_the_end(segment)], START, limits, T)
    assert violation is not None
    assert (violation.quantity, violation.time_s) == ("acceleration", pytest.approx(0.101))


def test_a_position_that_is_no_number_is_refused() -> None:
    recorded = np.zeros((10, 2))
    (segment,) = whole([Samples("r", recorded, np.zeros((10, 2)))])
    segment.position_m[4, 1] = np.nan
    violation = first_violation([segment], START, LIMITS, T)
    assert violation is not None
    assert (violation.axis, violation.quantity, violation.time_s) == (1, "position", 0.005)
