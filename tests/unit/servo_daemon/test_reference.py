"""Rows of a program and of a controlled stop, against closed forms."""

import numpy as np
import pytest

from servo_ctrl.axis.servo import REFERENCE_FIELDS
from servo_ctrl.daemon.set_points.reference import ProgramReference, interleave, stop_ramp
from servo_ctrl.motion.program import Segment

PERIOD_S = 0.001


def segment(step: int, first_sample: int, count: int, steady: tuple[int, int] = (0, 0)) -> Segment:
    base = np.arange(2 * count, dtype=np.float64).reshape(count, 2) + 100.0 * step
    return Segment(
        step, f"step {step}", "move", base, base + 0.1, base + 0.2, base + 0.3, first_sample, steady
    )


def test_row_holds_all_fields_axis_by_axis() -> None:
    rows = interleave(segment(0, 0, 2))
    assert rows[1] == [2.0, 2.1, 2.2, 2.3, 3.0, 3.1, 3.2, 3.3]


def test_rows_follow_each_other_over_steps_and_their_chunks() -> None:
    program = ProgramReference([segment(0, 0, 3), segment(0, 3, 2), segment(1, 0, 1)])
    rows = [program.advance(10 + i) for i in range(7)]
    assert [None if row is None else row[0] for row in rows] == [0.0, 2.0, 4.0, 0.0, 2.0, 100.0, None]
    assert [(s.step, s.first_cycle, s.last_cycle) for s in program.spans] == [(0, 10, 14), (1, 15, 15)]


def test_cycles_at_constant_speed_are_joined_over_chunks() -> None:
    chunks = [
        segment(0, 0, 4),
        segment(0, 4, 4, (2, 4)),
        segment(0, 8, 4, (0, 4)),
        segment(0, 12, 4, (0, 1)),
        segment(0, 16, 4),
    ]
    program = ProgramReference(chunks)
    for cycle in range(20):
        program.advance(100 + cycle)
    assert (program.spans[0].steady_first_cycle, program.spans[0].steady_last_cycle) == (106, 112)


def row(*axes: tuple[float, float]) -> list[float]:
    return [x for position, velocity in axes for x in (position, velocity, 0.0, 9.0)]


def test_stop_takes_what_the_slowest_axis_needs_and_stays_within_all_limits() -> None:
    limits = [2.0, 5.0]
    last = row((0.1, -0.05), (0.2, 0.05))
    rows = np.array(list(stop_ramp(last, limits, PERIOD_S)))
    assert len(rows) == 25  # 0.05 m/s at 2 m/s^2
    velocity, acceleration = rows[:, 1::REFERENCE_FIELDS], rows[:, 2::REFERENCE_FIELDS]
    assert np.abs(acceleration[:-1]).max(axis=0) == pytest.approx([2.0, 2.0])
    # v^2 / 2a, the way of a constant deceleration
    assert rows[-1, 0::REFERENCE_FIELDS] == pytest.approx([0.1 - 0.05**2 / 4.0, 0.2 + 0.05**2 / 4.0])
    assert not rows[-1, 1::REFERENCE_FIELDS].any()
    assert not rows[:, 3::REFERENCE_FIELDS].any()
    steps = np.diff(np.vstack(([0.1, 0.2], rows[:, 0::REFERENCE_FIELDS])), axis=0) / PERIOD_S
    middle = 0.5 * (np.vstack(([-0.05, 0.05], velocity[:-1])) + velocity)
    assert steps == pytest.approx(middle, abs=1e-12)


def test_axes_stay_on_their_line_while_they_stop() -> None:
    rows = np.array(list(stop_ramp(row((0.0, 0.03), (0.0, 0.04)), [1.0, 1.0], PERIOD_S)))
    assert rows[:, 0] * 4.0 == pytest.approx(rows[:, 4] * 3.0)


def test_machine_at_rest_stops_in_one_row() -> None:
    assert list(stop_ramp(row((0.3, 0.0)), [1.0], PERIOD_S)) == [[0.3, 0.0, 0.0, 0.0]]


def test_time_that_is_no_whole_number_of_periods_ends_at_rest_at_its_true_end() -> None:
    rows = list(stop_ramp(row((0.0, 0.0105)), [1.0], PERIOD_S))
    assert len(rows) == 11
    assert rows[-1] == pytest.approx([0.0105**2 / 2.0, 0.0, 0.0, 0.0])
