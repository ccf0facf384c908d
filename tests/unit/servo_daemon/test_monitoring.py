"""Reversals found in the rows of a run: online equals offline, for any command and any missing rows."""

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from path_deviation import path_deviation
from recorded_rows import rows_of

from kernels.arrays import Array
from servo_ctrl.config.learning_model import MonitoringConfig
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.learning.monitoring import ReversalMonitor
from servo_ctrl.learning.performance import evaluation_m, indicators, reversals
from servo_ctrl.learning.types import ReversalReport

TABLE = load_machine(Path(__file__).parents[3] / "machines" / "xy_table")
PERIOD_S = TABLE.period_s
WINDOW = 4


def machine(axes: int = 2, **monitoring: Any) -> MachineConfig:
    section = MonitoringConfig(**{"window_s": WINDOW * PERIOD_S, "due_after_reversals": 2} | monitoring)
    chosen = dict(zip(("x", "y", "z")[:axes], [*TABLE.axes.values()] * 2, strict=False))
    return TABLE.model_copy(update={"monitoring": section, "axes": chosen})


class Watched(NamedTuple):
    monitoring: ReversalMonitor
    reports: list[ReversalReport]
    axes: list[int]
    traces_m: list[Array]
    due: list[tuple[int, bool]]


def watched(config: MachineConfig) -> Watched:
    reports: list[ReversalReport] = []
    axes: list[int] = []
    traces: list[Array] = []
    due: list[tuple[int, bool]] = []

    def on_reversal(axis: int, report: ReversalReport, trace_m: Array) -> None:
        axes.append(axis)
        reports.append(report)
        traces.append(trace_m)

    monitoring = ReversalMonitor(config, on_reversal, lambda i, now: due.append((i, now)))
    return Watched(monitoring, reports, axes, traces, due)


def fed(config: MachineConfig, *arrays: Array, **more: Array) -> Watched:
    made = watched(config)
    for row in rows_of(list(config.axes), *arrays, PERIOD_S, **more):
        made.monitoring.observe(row)
    return made


def column(values: list[float]) -> Array:
    """One axis, micrometres -> metres."""
    return np.array(values)[:, np.newaxis] * 1e-6


STEPS = st.sampled_from([-3.0, -1.0, 0.0, 0.0, 1.0, 1.0, 2.0])
ROW = st.tuples(STEPS, STEPS, st.integers(-90, 90), st.integers(-90, 90))
FLAWS = st.sampled_from(["", *[""] * 30, "power", "x scale", "y scale", "missed", "outside"])
RUN = st.lists(st.tuples(ROW, FLAWS), min_size=2, max_size=80)


def offline(run: Array, cycle: Array, segment: Array) -> tuple[list[tuple[Any, ...]], list[int]]:
    """Reports of a stretch (n, 4: commands, positions) from whole arrays, and the reversals of each axis."""
    command_m, position_m = run[:, :2], run[:, 2:]
    found: list[tuple[Any, ...]] = []
    seen = []
    for axis in range(2):
        starts = reversals(command_m[:, axis])
        seen.append(len(starts))
        size_m = np.abs(command_m[:, axis] - position_m[:, axis])
        other_moved = np.diff(command_m[:, 1 - axis], prepend=command_m[0, 1 - axis]) != 0.0
        deviation_m = path_deviation(command_m, position_m)
        both = [indicators(command_m[:, axis], position_m[:, axis], c, WINDOW) for c in (deviation_m, size_m)]
        for in_plane, on_line in zip(*both, strict=True):
            part = slice(in_plane.reversal, in_plane.reversal + WINDOW)
            one = in_plane if other_moved[part].any() else on_line
            cut = ((starts > one.reversal) & (starts < part.stop)).any() or (segment[part] < 0).any()
            if not cut and not any(map(math.isnan, one)):
                found.append((axis, cycle[one.reversal], one.direction, *one[2:]))
    return found, seen


@given(RUN)
def test_online_equals_offline_on_any_command_with_anything_missing(run: list[Any]) -> None:
    table = np.array([row for row, _ in run])
    flaws = np.array([flaw for _, flaw in run])
    command_m = np.cumsum(table[:, :2], axis=0) * 1e-6
    position_m = command_m - table[:, 2:] * 1e-7
    command_m[flaws == "power"] = math.nan
    position_m[flaws == "x scale", 0] = math.nan
    position_m[flaws == "y scale", 1] = math.nan
    segment = np.where(flaws == "outside", -1.0, 0.0)
    cycle = np.cumsum(np.where(flaws == "missed", 2.0, 1.0))
    made = fed(machine(), command_m, position_m, cycle=cycle, segment=segment)

    breaks = np.isnan(command_m[:, 0]) | (flaws == "missed")
    ends = [*np.flatnonzero(breaks), len(run)]
    expected: list[tuple[Any, ...]] = []
    seen = np.zeros(2, dtype=np.int64)
    for start, stop in zip([0, *ends[:-1]], ends, strict=True):
        rows = slice(start + int(np.isnan(command_m[start, 0])), stop)
        if rows.start < rows.stop:
            whole = np.hstack((command_m[rows], position_m[rows]))
            wanted, reversed_ = offline(whole, cycle[rows], segment[rows])
            expected += wanted
            seen += reversed_
    found = sorted((axis, *report) for axis, report in zip(made.axes, made.reports, strict=True))
    assert [entry[:3] for entry in found] == [entry[:3] for entry in sorted(expected)]
    for report, entry in zip(found, sorted(expected), strict=True):
        assert report[4:] == pytest.approx(entry[3:], rel=1e-12)
    evaluated_or_cut_off = np.add(made.monitoring.counts, made.monitoring.cut_off)
    assert (seen - evaluated_or_cut_off <= 1).all(), "one window an axis may be open at the end"
    assert (seen >= evaluated_or_cut_off).all()


def test_reversal_cut_off_by_the_next_one_is_counted_and_the_next_one_evaluated() -> None:
    command = column([0, 1, 2, 1, 0, 1, 2, 3, 4])
    made = fed(machine(1), command, command)
    assert [report.cycle for report in made.reports] == [5]
    assert (made.monitoring.counts, made.monitoring.cut_off) == ([1], [1])


@pytest.mark.parametrize(
    ("flaw", "cut_off"),
    [("nothing", 0), ("scale", 1), ("power", 1), ("end of the program", 1), ("missed tick", 1)],
)
@pytest.mark.parametrize("sample", range(1, WINDOW))
def test_window_that_is_not_whole_is_not_evaluated(flaw: str, cut_off: int, sample: int) -> None:
    command = column([0, 1, 2, 1, 0, -1, -2, -3])
    position, cycle, segment = command.copy(), np.arange(8.0), np.zeros(8)
    at = 3 + sample
    match flaw:
        case "scale":
            position[at] = math.nan
        case "power":
            command[at:] = math.nan
        case "end of the program":
            segment[at:] = -1.0
        case "missed tick":
            cycle[at:] += 1.0
    made = fed(machine(1), command, position, cycle=cycle, segment=segment)
    assert (made.monitoring.counts, made.monitoring.cut_off) == ([1 - cut_off], [cut_off])


def test_re_enabled_axis_has_no_direction_yet() -> None:
    command = column([0, 1, 2, math.nan, math.nan, 1, 0, -1, -2, -3, -4])
    made = fed(machine(1), command, command)
    assert (made.monitoring.counts, made.monitoring.cut_off) == ([0], [0])


def test_creep_below_the_rounding_of_a_position_is_no_reversal() -> None:
    command = column([0, 1, 2, 3]).tolist() + [[3e-6 - i * 0.9e-12] for i in range(1, 9)]
    made = fed(machine(1), np.array(command), np.array(command))
    assert (made.monitoring.counts, made.monitoring.cut_off) == ([0], [0])


def test_axis_without_a_scale_is_judged_by_its_motor_encoder() -> None:
    config = machine(1)
    axis = config.axes["x"].model_copy(update={"scale": None})
    command = column([0, 1, 2, 1, 0, -1, -2, -3])
    made = fed(
        config.model_copy(update={"axes": {"x": axis}}), command, command * math.nan, motor_m=command - 2e-6
    )
    assert [report.error_mean_m for report in made.reports] == [pytest.approx(2e-6)]


def test_third_axis_is_judged_along_its_own_line() -> None:
    z = column([0, 1, 2, 1, 0, -1, -2, -3])
    command = np.hstack((z[::-1], z[::-1], z))
    made = fed(machine(3), command, command - np.array([0.0, 9e-6, 2e-6]))
    third = [report for axis, report in zip(made.axes, made.reports, strict=True) if axis == 2]
    assert [(r.contour_peak_m, r.error_peak_m) for r in third] == [(pytest.approx(2e-6), pytest.approx(2e-6))]


def there_and_back(lag_m: list[float]) -> tuple[Array, Array]:
    """A reversal each, WINDOW samples long, at which the axis lags by so much."""
    ways = [(-1.0) ** i for i in range(len(lag_m) + 1) for _ in range(WINDOW)]
    command_m = np.cumsum(ways)[:, np.newaxis] * 1e-5
    lags_m = np.repeat([0.0, *lag_m], WINDOW) * np.sign(ways)
    return command_m, command_m - lags_m[:, np.newaxis]


def test_learning_due_is_reported_once_as_it_begins_and_once_as_it_ends() -> None:
    made = watched(machine(1, required_um=4.0, settled_below=0.9))
    reports_due: list[tuple[int, int, bool]] = []
    made.monitoring._on_due = lambda axis, due: reports_due.append((len(made.reports), axis, due))
    lags = [5e-6, 1e-6, 5e-6, 5e-6, 5e-6, 3.8e-6, 3e-6, 5e-6, 3e-6, 3e-6, 3e-6]
    for row in rows_of(["x"], *there_and_back(lags), PERIOD_S):
        made.monitoring.observe(row)
    assert reports_due == [(4, 0, True), (10, 0, False)]
    assert (made.monitoring.counts, made.monitoring.due) == ([11], [False])
    assert made.monitoring.last == [made.reports[-1]]
    assert [evaluation_m(trace) for trace in made.traces_m] == pytest.approx(lags)
    assert all((trace > 0.0).all() for trace in made.traces_m), "it lags in both directions"


def test_new_requirement_counts_from_the_next_reversal_on() -> None:
    made = watched(machine(1, required_um=2.5))
    for row in rows_of(["x"], *there_and_back([3e-6] * 4), PERIOD_S):
        if len(made.reports) == 1:
            made.monitoring.required_m = 2e-6  # the bad reversal before is forgotten: two more are needed
        made.monitoring.observe(row)
        assert made.monitoring.due == [len(made.reports) >= 3]
    assert made.due == [(0, True)]
