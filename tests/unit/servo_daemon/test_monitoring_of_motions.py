"""Monitoring on the motions of the paper, made by the batch twin: indicators as from the whole run."""

from pathlib import Path

import numpy as np
import pytest
from path_deviation import path_deviation
from recorded_rows import rows_of

from hil_sim.config import load_plant
from kernels.arrays import Array
from servo_ctrl.config.kernel_params import axis_params, motion_limits
from servo_ctrl.config.load import load_machine
from servo_ctrl.daemon.learning.monitoring import ReversalMonitor
from servo_ctrl.learning.performance import (
    Indicators,
    circle_deviation,
    combined,
    commanded_circle,
    evaluation_m,
    indicators,
    window_samples,
)
from servo_ctrl.learning.types import ReversalReport
from servo_ctrl.motion.circle import Circle
from servo_ctrl.motion.program import Step, segments
from servo_ctrl.motion.sine import Sine
from servo_ctrl.motion.trapezoidal import ThereAndBack
from twin.rollout import rollout

MACHINE = Path(__file__).parents[3] / "machines" / "xy_table"
TABLE = load_machine(MACHINE)
PERIOD_S = TABLE.period_s
WINDOW = window_samples(TABLE.monitoring.window_s, PERIOD_S)
RADIUS_M = 0.025
S_SHAPES = {"S1": (10, 10, 30), "S2": (20, 20, 30), "S3": (20, 30, 50), "S4": (30, 30, 80)}
"""Acceleration mm/s^2, speed mm/s, distance mm."""


def made(step: Step) -> tuple[list[tuple[int, ReversalReport]], list[Array], Array, Array]:
    """Reports and traces, commands and scale positions (n, 2) of a step on the uncompensated table."""
    plan = list(segments([step], np.zeros(2), motion_limits(TABLE), PERIOD_S))
    joined = [
        np.concatenate([getattr(part, field) for part in plan])
        for field in ("position_m", "velocity_m_s", "acceleration_m_s2", "force_offset_n")
    ]
    params = {axis: axis_params(TABLE, axis) for axis in TABLE.axes}
    reference = {
        axis: np.stack([field[:, i] for field in joined], axis=-1) for i, axis in enumerate(TABLE.axes)
    }
    columns = rollout(TABLE, load_plant(MACHINE), params, reference)
    command, velocity, scale = (
        np.column_stack([columns[f"{axis}.{name}"] for axis in TABLE.axes])
        for name in ("position_command_m", "velocity_command_m_s", "scale_position_m")
    )
    reports: list[tuple[int, ReversalReport]] = []
    traces: list[Array] = []

    def on_reversal(axis: int, report: ReversalReport, trace_m: Array) -> None:
        reports.append((axis, report))
        traces.append(trace_m)

    monitoring = ReversalMonitor(TABLE, on_reversal, lambda _axis, _due: None)
    for row in rows_of(list(TABLE.axes), command, scale, PERIOD_S, velocity_m_s=velocity):
        monitoring.observe(row)
    assert monitoring.counts == [sum(of == axis for of, _report in reports) for axis in range(2)]
    return reports, traces, command, scale


def assert_same(reports: list[ReversalReport], offline: list[Indicators]) -> None:
    assert [(report.cycle, report.direction) for report in reports] == [entry[:2] for entry in offline]
    for report, entry in zip(reports, offline, strict=True):
        assert report[3:] == pytest.approx(entry[2:], rel=1e-12)


@pytest.mark.parametrize("feed_mm_min", [500, 3000])
def test_circle_online_indicators_equal_the_offline_evaluation(feed_mm_min: int) -> None:
    feed_m_s = feed_mm_min / 60e3
    reports, traces, command, scale = made(Circle("c", (0, 1), RADIUS_M, feed_m_s, 1.2, True, 0.5))
    deviation_m = path_deviation(command, scale)
    circle = commanded_circle(command[:, 0], command[:, 1])
    radial_m = circle_deviation(circle, scale[:, 0], scale[:, 1])
    for axis in range(2):
        own = [report for of, report in reports if of == axis]
        assert_same(own, indicators(command[:, axis], scale[:, axis], deviation_m, WINDOW))
        assert len(own) == 2
        assert [report.acceleration_m_s2 for report in own] == pytest.approx(
            [feed_m_s**2 / RADIUS_M] * 2, rel=1e-3
        )
        ballbar = combined(indicators(command[:, axis], scale[:, axis], radial_m, WINDOW))
        peak_m = max(report.contour_peak_m for report in own)
        # the chord of a period stands for the tangent: an error along it is seen by half its angle
        along_m = np.abs(command - scale).max() * feed_m_s * PERIOD_S / RADIUS_M
        assert peak_m == pytest.approx(ballbar.contour_peak_m, abs=along_m)
        assert peak_m > 3e-6, "the table is not compensated"
    assert [evaluation_m(trace) for trace in traces] == [report.error_mean_m for _axis, report in reports]
    assert all(np.mean(trace) > 0.0 for trace in traces), "friction makes the table lag"


@pytest.mark.parametrize("name", S_SHAPES)
def test_s_shape_online_indicators_equal_the_offline_evaluation(name: str) -> None:
    acceleration_m_s2, speed_m_s, distance_m = (value * 1e-3 for value in S_SHAPES[name])
    step = ThereAndBack(name, 1, distance_m, speed_m_s, acceleration_m_s2, 2)
    reports, _, command, scale = made(step)
    error_m = command[:, 1] - scale[:, 1]
    own = [report for axis, report in reports if axis == 1]
    assert_same(own, indicators(command[:, 1], scale[:, 1], error_m, WINDOW))
    assert len(own) == len(reports) == 3
    assert all(report.contour_peak_m == report.error_peak_m for report in own)
    assert [report.acceleration_m_s2 for report in own] == pytest.approx([acceleration_m_s2] * 3)


def test_sine_online_indicators_equal_the_offline_evaluation() -> None:
    speed_rad_s = 1.0
    found, _, command, scale = made(Sine("s", 0, 0.05, speed_rad_s, 1.0, 0.5))
    reports = [report for _axis, report in found]
    assert_same(reports, indicators(command[:, 0], scale[:, 0], command[:, 0] - scale[:, 0], WINDOW))
    assert [report.direction for report in reports] == [-1, 1]
    assert [report.acceleration_m_s2 for report in reports] == pytest.approx(
        [0.05 * speed_rad_s**2] * 2, rel=1e-3
    )
