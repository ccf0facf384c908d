"""From rows of the recording to the samples of a stroke."""

import math
from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.cycle.rows import RowRouter
from servo_ctrl.daemon.learning.collectors import GAP_SAMPLES_MAX, bridged, stroke_collector

NAN = math.nan


def row(cycle: int, x_m: tuple[float, float], y_m: tuple[float, float]) -> list[float]:
    """Command and scale position of both axes; whatever else is 99."""
    axes = [[command_m, 99.0, 99.0, scale_m, *[99.0] * 8] for command_m, scale_m in (x_m, y_m)]
    return [cycle * 1e-3, cycle, 0, *axes[0], *axes[1]]


def test_samples_are_those_of_the_axis_and_of_its_scale(machine_file: Path) -> None:
    taken = stroke_collector(load_machine(machine_file), "y")
    for cycle in range(5):
        taken.take(row(cycle, (7.0, 8.0), (0.1 * cycle, 0.2 * cycle)))
    command_m, position_m = taken.samples()
    np.testing.assert_allclose(command_m, [0.0, 0.1, 0.2, 0.3, 0.4])
    np.testing.assert_allclose(position_m, [0.0, 0.2, 0.4, 0.6, 0.8])


def test_missed_ticks_leave_a_gap_in_the_position_and_none_in_the_command(machine_file: Path) -> None:
    taken = stroke_collector(load_machine(machine_file), "x")
    for cycle in (10, 11, 16, 17):
        taken.take(row(cycle, (float(cycle), float(cycle)), (0.0, 0.0)))
    command_m, position_m = taken.samples()
    assert command_m.tolist() == [10.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0, 17.0]
    np.testing.assert_array_equal(position_m, [10.0, 11.0, NAN, NAN, NAN, NAN, 16.0, 17.0])


@given(st.lists(st.one_of(st.just(NAN), st.integers(-9, 9)), min_size=1, max_size=30))
def test_brief_gaps_are_bridged_by_straight_lines_and_no_others(values: list[float]) -> None:
    found = bridged(np.array(values, dtype=np.float64))
    start = 0
    while start < len(values):
        stop = start
        while stop < len(values) and math.isnan(values[stop]):
            stop += 1
        bridged_gap = start > 0 and stop < len(values) and 0 < stop - start <= GAP_SAMPLES_MAX
        for index in range(start, stop):
            if bridged_gap:
                share = (index - start + 1) / (stop - start + 1)
                line = values[start - 1] + share * (values[stop] - values[start - 1])
                assert math.isclose(found[index], line, abs_tol=1e-12)
            else:
                assert math.isnan(found[index])
        if stop < len(values):
            assert found[stop] == values[stop]
        start = stop + 1


def test_rows_are_streamed_always_and_observed_outside_of_strokes(machine_file: Path) -> None:
    observed: list[list[float]] = []
    streamed: list[list[float]] = []
    rows = RowRouter(observed.append)
    rows.take(row(0, (0.0, 0.0), (0.0, 0.0)))
    rows.stream = streamed.append
    rows.stroke = stroke_collector(load_machine(machine_file), "x").take
    rows.take(row(1, (0.0, 0.0), (0.0, 0.0)))
    rows.stroke = None
    rows.take(row(2, (0.0, 0.0), (0.0, 0.0)))
    assert [values[1] for values in observed] == [0, 2]
    assert [values[1] for values in streamed] == [1, 2]
