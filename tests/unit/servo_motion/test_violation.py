"""The check of motion limits alone: values at the boundary pass or fail, and the violation is reported."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from servo_ctrl.motion.profile import MotionLimits
from servo_ctrl.motion.program import Segment
from servo_ctrl.motion.violation import Violation, first_violation, stop_at_the_end

T = 2.0**-10
"""s; a power of two, so that x / T loses nothing."""
LIMITS = MotionLimits(
    position_min_m=np.array([-1.0, -3.0]),
    position_max_m=np.array([2.0, 4.0]),
    velocity_m_s=np.array([8.0, 16.0]),
    acceleration_m_s2=np.array([32.0, 64.0]),
    jerk_m_s3=np.array([65536.0, 131072.0]),
    force_n=np.array([100.0, 200.0]),
)
REST = np.zeros(2)
HAIR = 1e-9


def segment(rows: int = 4, *, first: int = 0, step: int = 5, **columns: NDArray[np.float64]) -> Segment:
    """At rest at zero but for the columns given."""
    still = {
        name: columns.get(name, np.zeros((rows, 2)))
        for name in ("position_m", "velocity_m_s", "acceleration_m_s2", "force_offset_n")
    }
    return Segment(step, "label", "move", **still, first_sample=first, steady=(0, 0))


def one(row: int, axis: int, value: float, rows: int = 4) -> NDArray[np.float64]:
    made = np.zeros((rows, 2))
    made[row, axis] = value
    return made


def found(*program: Segment, start: NDArray[np.float64] = REST) -> Violation | None:
    return first_violation(program, start, LIMITS, T)


# quantity, column, axis, limit, span between the limits. The neighbours of a lone value would jump too far,
# so positions and velocities are held from the first sample on, by a start there.
CASES = [
    ("position", "position_m", 0, 2.0, 3.0),
    ("position", "position_m", 0, -1.0, 3.0),
    ("position", "position_m", 1, 4.0, 7.0),
    ("position", "position_m", 1, -3.0, 7.0),
    ("acceleration", "acceleration_m_s2", 0, 32.0, 64.0),
    ("acceleration", "acceleration_m_s2", 1, -64.0, 128.0),
    ("force offset", "force_offset_n", 0, 100.0, 200.0),
    ("force offset", "force_offset_n", 0, -100.0, 200.0),
    ("force offset", "force_offset_n", 1, 200.0, 400.0),
    ("force offset", "force_offset_n", 1, -200.0, 400.0),
]


@pytest.mark.parametrize(("quantity", "column", "axis", "limit", "span"), CASES)
def test_value_at_the_limit_passes_within_rounding(
    quantity: str, column: str, axis: int, limit: float, span: float
) -> None:
    start = REST.copy()
    if column == "position_m":
        start[axis] = limit
    for share, passes in ((0.0, True), (1.0, True), (1.1, False)):
        value = limit + np.sign(limit) * share * HAIR * span
        columns: dict[str, Any] = {column: np.tile(start, (4, 1))}
        columns[column][2, axis] = value
        violation = found(segment(**({"position_m": np.tile(start, (4, 1))} | columns)), start=start)
        if passes:
            assert violation is None
        else:
            assert violation == (5, "label", axis, quantity, value, limit, 3 * T)


@pytest.mark.parametrize(("axis", "limit"), [(0, 8.0), (0, -8.0), (1, 16.0), (1, -16.0)])
def test_analytic_velocity(axis: int, limit: float) -> None:
    """Held from a segment before, whose own start is too much for the acceleration and is not looked at."""
    program = segment(velocity_m_s=np.tile(one(0, axis, limit, 1), (4, 1)))
    within = found(program)
    assert within is not None
    assert within.quantity == "acceleration"  # the step into it is what is too much, not the velocity
    beyond = found(segment(velocity_m_s=np.tile(one(0, axis, limit * 1.001, 1), (4, 1))))
    assert beyond == (5, "label", axis, "velocity", pytest.approx(limit * 1.001), limit, T)


@pytest.mark.parametrize(("axis", "speed"), [(0, 8.0), (0, -8.0), (1, 16.0), (1, -16.0)])
def test_velocity_from_sample_to_sample_across_the_joint(axis: int, speed: float) -> None:
    """The step from the first segment's end to the second's first sample is one like any other."""
    for factor, passes in ((1.0, True), (1.001, False)):
        position = np.zeros((4, 2))
        position[:, axis] = speed * factor * T
        violation = found(segment(), segment(first=4, position_m=position))
        if passes:
            assert violation is None
        else:
            assert violation == (
                *(5, "label", axis, "velocity"),
                *(pytest.approx(speed * factor), speed, 5 * T),
            )


def test_first_sample_is_compared_with_the_start_position() -> None:
    assert found(segment(), start=np.array([8.0 * T, 0.0])) is None
    violation = found(segment(), start=np.array([8.01 * T, 0.0]))
    assert violation == (5, "label", 0, "velocity", pytest.approx(-8.01), -8.0, T)


@pytest.mark.parametrize(("axis", "acceleration"), [(0, 32.0), (0, -32.0), (1, 64.0), (1, -64.0)])
def test_acceleration_from_sample_to_sample_across_the_joint(axis: int, acceleration: float) -> None:
    for factor, passes in ((1.0, True), (1.001, False)):
        velocity = np.zeros((4, 2))
        velocity[:, axis] = acceleration * factor * T
        violation = found(segment(), segment(first=4, velocity_m_s=velocity))
        if passes:
            assert violation is None
        else:
            assert violation == (
                *(5, "label", axis, "acceleration"),
                *(pytest.approx(acceleration * factor), acceleration, 5 * T),
            )


@pytest.mark.parametrize(("axis", "jerk"), [(0, 65536.0), (0, -65536.0), (1, 131072.0), (1, -131072.0)])
def test_jerk_from_sample_to_sample_across_the_joint(axis: int, jerk: float) -> None:
    limits = LIMITS._replace(acceleration_m_s2=np.array([1e6, 1e6]))
    for factor, passes in ((1.0, True), (1.001, False)):
        acceleration = np.zeros((4, 2))
        acceleration[:, axis] = jerk * factor * T
        program = [segment(), segment(first=4, acceleration_m_s2=acceleration)]
        violation = first_violation(program, REST, limits, T)
        if passes:
            assert violation is None
        else:
            assert violation == (*(5, "label", axis, "jerk"), *(pytest.approx(jerk * factor), jerk, 5 * T))


def test_the_largest_excess_is_reported_not_the_largest_value() -> None:
    """Axis 0 is 1 N beyond, axis 1 is 3 N beyond below; the larger excess counts, not the larger value."""
    force = one(1, 0, 101.0) + one(2, 1, -203.0) + one(3, 1, 202.0)
    assert found(segment(force_offset_n=force)) == (5, "label", 1, "force offset", -203.0, -200.0, 3 * T)


def test_earlier_segment_and_earlier_quantity_come_first() -> None:
    late = segment(first=4, step=6, force_offset_n=one(0, 0, 500.0))
    assert found(segment(force_offset_n=one(3, 0, 101.0)), late) == (
        *(5, "label", 0, "force offset"),
        *(101.0, 100.0, 4 * T),
    )
    both = segment(acceleration_m_s2=one(0, 0, 33.0), force_offset_n=one(0, 0, 500.0))
    violation = found(both)
    assert violation is not None
    assert violation.quantity == "acceleration"


@pytest.mark.parametrize(
    ("column", "value"),
    [
        *((column, np.nan) for column in ("position_m", "velocity_m_s", "acceleration_m_s2")),
        *(("force_offset_n", value) for value in (np.nan, np.inf, -np.inf)),
    ],
)
def test_a_non_finite_value_is_a_violation(column: str, value: float) -> None:
    violation = found(segment(**{column: one(2, 1, value)}))
    assert violation is not None
    assert (violation.axis, violation.time_s) == (1, 3 * T)
    assert violation.value == pytest.approx(value, nan_ok=True)


def test_a_non_finite_value_is_the_largest_violation() -> None:
    violation = found(segment(force_offset_n=one(1, 0, 1e300) + one(3, 1, np.nan)))
    assert violation is not None
    assert (violation.axis, violation.time_s) == (1, 4 * T)


def test_rounding_of_a_position_far_out_is_no_velocity() -> None:
    """At 1e9 m a double has steps of 1.2e-7 m: 2^10 times that in a period is 1.2e-4 m/s."""
    far = MotionLimits(
        position_min_m=np.array([0.0]),
        position_max_m=np.array([2e9]),
        velocity_m_s=np.array([1e-4]),
        acceleration_m_s2=np.array([1.0]),
        jerk_m_s3=np.array([1.0]),
        force_n=np.array([1.0]),
    )
    start = np.array([1e9])
    columns = {name: np.zeros((1, 1)) for name in ("velocity_m_s", "acceleration_m_s2", "force_offset_n")}

    def check(steps: int) -> Violation | None:
        position = np.array([[1e9 + steps * np.spacing(1e9)]])
        one_sample = Segment(0, "", "move", position, **columns, first_sample=0, steady=(0, 0))
        return first_violation([one_sample], start, far, T)

    assert check(1) is None
    assert check(-1) is None
    assert check(4) is not None
    assert check(-4) is not None


def test_without_samples_there_is_no_violation() -> None:
    assert found(segment(rows=0)) is None
    assert found() is None


def test_stop_at_the_end_adds_one_sample_at_rest_after_the_last() -> None:
    last = segment(
        3,
        first=7,
        position_m=np.array([[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]]),
        velocity_m_s=np.ones((3, 2)),
        acceleration_m_s2=np.ones((3, 2)),
        force_offset_n=np.ones((3, 2)),
    )
    stop = stop_at_the_end(last._replace(steady=(1, 2)))
    assert stop.position_m.tolist() == [[0.5, 0.6]]
    for column in (stop.velocity_m_s, stop.acceleration_m_s2, stop.force_offset_n):
        assert column.tolist() == [[0.0, 0.0]]
    assert (stop.step, stop.label, stop.first_sample, stop.steady) == (5, "label", 10, (0, 0))
