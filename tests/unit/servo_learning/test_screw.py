"""Learning the screw on an axis whose errors are known: formulas instead of a machine."""

import math
from typing import Any

import numpy as np
import pytest

from kernels.arrays import Array
from servo_ctrl.learning.screw import ScrewRun, error_table, evaluation_m, learned_screw
from servo_ctrl.learning.screw_travel import (
    Pass,
    ScrewSettings,
    deviations_m,
    nodes_m,
    passes_of,
    run_in_nodes,
    travel_s,
)

PERIOD_S = 1e-3
LEAD_M = 5e-3
SETTINGS = ScrewSettings(
    lower_m=-0.02,
    upper_m=0.02,
    step_m=LEAD_M / 16.0,
    travels=3,
    feed_m_s=1.0 / 60.0,
    dwell_s=0.2,
    limit_m=2e-4,
)
LOST_M = 8e-6


def screw_error_m(motor_m: Array) -> Array:
    """Drunken thread and a pitch that is too long by 1 in 10,000."""
    turns = motor_m / LEAD_M
    return np.asarray(1e-4 * motor_m + 2e-6 * np.sin(2.0 * math.pi * turns + 0.7))


class Axis:
    """A motor that lags behind its set point, and a table on a screw with errors and play."""

    def __init__(self, *, lost_m: float = LOST_M, count_m: float = 5e-7, sign: float = 1.0) -> None:
        self.lost_m, self.count_m, self.sign = lost_m, count_m, sign
        self.drift_m = 0.0

    def travel(
        self, settings: ScrewSettings = SETTINGS, table: Array | None = None, lost_motion_m: float = 0.0
    ) -> tuple[Array, Array, Array, Array]:
        """Command, correction, motor and scale of one travel from the lower end, 1000 samples a second."""
        length_m = settings.upper_m - settings.lower_m
        way = np.arange(1, round(length_m / settings.feed_m_s / PERIOD_S)) * PERIOD_S * settings.feed_m_s
        rest = np.zeros(round(settings.dwell_s / PERIOD_S))
        command_m = settings.lower_m + np.concatenate([rest, way, rest + length_m, length_m - way, rest])
        direction = np.ones(len(command_m))
        direction[: len(rest)] = direction[2 * len(rest) + len(way) :] = -1.0
        correction_m = np.zeros(len(command_m))
        if table is not None:
            correction_m = 0.5 * lost_motion_m * direction - np.interp(command_m, *table)
        motor_m = np.empty(len(command_m))
        at_m = led_to_m = 0.0
        at_m = command_m[0] + correction_m[0]
        for i, led_to_m in enumerate(command_m + correction_m):
            at_m += (led_to_m - at_m) * 38.7 * PERIOD_S
            motor_m[i] = at_m
        # play: the table is dragged along when the gap is closed
        nut_m = motor_m + screw_error_m(motor_m)
        table_m = np.empty(len(nut_m))
        at_m = nut_m[0] + 0.5 * self.lost_m
        for i, nut in enumerate(nut_m):
            at_m = min(max(at_m, nut - 0.5 * self.lost_m), nut + 0.5 * self.lost_m)
            table_m[i] = at_m
        scale_m = np.floor((self.sign * table_m + self.drift_m) / self.count_m) * self.count_m
        return command_m, correction_m, motor_m, scale_m


def read(axis: Axis, settings: ScrewSettings = SETTINGS, **compensated: Any) -> Array:
    return deviations_m(*passes_of(*axis.travel(settings, **compensated), settings), settings)


@pytest.fixture(scope="module")
def travels_m() -> list[Array]:
    axis, found = Axis(), []
    for drift_m in (0.0, 1e-7, 2e-7):
        axis.drift_m = drift_m
        found.append(read(axis))
    return found


def test_table_and_lost_motion_are_those_of_the_screw(travels_m: list[Array]) -> None:
    learned = learned_screw(travels_m, SETTINGS)
    assert learned.lost_motion_m == pytest.approx(LOST_M, abs=0.05e-6)
    positions_m, error_m = error_table(learned)
    assert len(positions_m) == 129
    # the table is at x where the motor is at x - e(x), and nothing is known of a constant
    motor_m = positions_m - error_m
    wrong_m = error_m - screw_error_m(motor_m)
    assert np.ptp(wrong_m) < 0.15e-6
    assert np.interp(0.0, positions_m, error_m) == pytest.approx(0.0, abs=0.02e-6)
    assert (learned.strokes, learned.machine_time_s) == (3, 3.0 * travel_s(SETTINGS))
    assert learned.spread_m == pytest.approx(1e-7, abs=0.5e-7)


def test_ends_are_known_although_each_is_read_in_one_direction_only(travels_m: list[Array]) -> None:
    up_m, down_m = travels_m[0]
    assert math.isnan(up_m[0])
    assert math.isnan(down_m[-1])
    assert np.isfinite(up_m[run_in_nodes(SETTINGS) :]).all()
    assert np.isfinite(down_m[: -run_in_nodes(SETTINGS)]).all()
    learned = learned_screw(travels_m, SETTINGS)
    assert [learned.points[place][2] for place in (0, -1)] == [learned.lost_motion_m] * 2


def test_the_learned_table_removes_the_error() -> None:
    run, axis = ScrewRun(SETTINGS), Axis()
    stages = []
    while (stroke := run.stroke) is not None:
        stages.append((stroke.stage, run.outlook.strokes_done))
        run.take(read(axis, table=stroke.table, lost_motion_m=stroke.lost_motion_m))
    assert stages == [("travel", 0), ("travel", 1), ("travel", 2), ("check", 3)]
    assert run.learned is not None
    assert run.learned.before_m > 3.5e-6
    assert run.learned.after_m < 0.1e-6
    assert run.learned.strokes == 4
    assert (run.outlook.stage, run.outlook.strokes_done, run.outlook.remaining_s) == ("done", 4, 0.0)


def test_evaluation_is_the_mean_absolute_deviation_from_the_mean() -> None:
    # up 0, 2, 4 um, down 8, 6, 4 um: mean 4, deviations 4, 2, 0, 4, 2, 0
    assert evaluation_m([np.array([[0.0, 2e-6, 4e-6], [8e-6, 6e-6, 4e-6]])]) == pytest.approx(2e-6)
    # where it was set equal, and what was not read, say nothing
    shifted = np.array([[7e-6, 9e-6, np.nan], [15e-6, 13e-6, np.nan]])
    assert evaluation_m([shifted]) == pytest.approx(evaluation_m([shifted - 7e-6]))


def test_correction_is_that_of_the_set_point_which_the_motor_follows() -> None:
    """The loop lags by 0.4 mm, in which a periodic error changes by a micrometre."""
    axis = Axis(lost_m=0.0)
    positions_m = np.linspace(-0.021, 0.021, 5000)
    exact = np.array([positions_m + screw_error_m(positions_m), screw_error_m(positions_m)])
    assert np.nanmax(np.abs(read(axis, table=exact) + 2.5e-7)) < 0.15e-6


def test_missing_samples_are_left_out_and_a_gap_is_refused() -> None:
    command_m, correction_m, motor_m, scale_m = Axis().travel()
    scale_m[::7] = np.nan
    motor_m[3::11] = np.nan
    whole = read(Axis())
    holes = deviations_m(*passes_of(command_m, correction_m, motor_m, scale_m, SETTINGS), SETTINGS)
    assert np.nanmax(np.abs(holes - whole)) < 0.2e-6
    scale_m[(np.abs(command_m) < 1e-3) & (np.gradient(command_m) < 0.0)] = np.nan
    up, down = passes_of(command_m, correction_m, motor_m, scale_m, SETTINGS)
    with pytest.raises(
        ValueError, match=r"on the travel down nothing was read at -?0\.\d+ mm: samples are missing"
    ):
        deviations_m(up, down, SETTINGS)


@pytest.mark.parametrize("kept", [slice(0, 1500), slice(1200, None)])
def test_half_a_travel_is_refused(kept: slice) -> None:
    with pytest.raises(ValueError, match="has not gone from the lower end to the upper one and back"):
        passes_of(*(column[kept] for column in Axis().travel()), SETTINGS)


def test_passes_without_samples_are_refused() -> None:
    command_m, correction_m, motor_m, scale_m = Axis().travel()
    with pytest.raises(ValueError, match="no samples of scale and encoder"):
        passes_of(command_m, correction_m, motor_m, np.full(len(scale_m), np.nan), SETTINGS)
    empty = Pass(np.array([]), np.array([]))
    with pytest.raises(ValueError, match="nothing was read"):
        deviations_m(empty, empty, SETTINGS)


def test_table_that_leads_the_motor_is_refused() -> None:
    up_m, down_m = read(Axis())
    with pytest.raises(ValueError, match=r"the table leads the motor by 8\.0\d um instead of lagging"):
        learned_screw([np.array([down_m, up_m])] * 2, SETTINGS)


def test_scale_with_opposite_direction_is_refused() -> None:
    axis = Axis(sign=-1.0)
    with pytest.raises(ValueError, match="do not count in the same direction"):
        learned_screw([read(axis)] * 2, SETTINGS)


def test_readings_that_differ_as_much_as_the_error_are_refused() -> None:
    noise_m = np.random.default_rng(5).normal(0.0, 1e-6, (3, 2, len(nodes_m(SETTINGS))))
    with pytest.raises(ValueError, match="there is nothing to compensate"):
        learned_screw(list(noise_m), SETTINGS)


def test_an_error_with_a_jump_is_refused() -> None:
    fine = SETTINGS._replace(step_m=1e-4)
    travel_m = np.zeros((2, len(nodes_m(fine))))
    travel_m[:, 250:] = -1.9e-4
    with pytest.raises(ValueError, match="the error changes faster than the position"):
        learned_screw([travel_m, travel_m], fine)


def test_correction_beyond_the_limit_is_refused() -> None:
    axis = Axis()
    with pytest.raises(ValueError, match=r"up to 9\.0 um, 7 um are allowed; check lead, counts"):
        learned_screw([read(axis)] * 2, SETTINGS._replace(limit_m=7e-6))


def test_one_travel_is_not_enough(travels_m: list[Array]) -> None:
    with pytest.raises(ValueError, match="at least two travels"):
        learned_screw(travels_m[:1], SETTINGS)


def test_nodes_are_the_ends_and_no_further_apart_than_the_step() -> None:
    nodes = nodes_m(SETTINGS._replace(step_m=0.0095))
    assert nodes.tolist() == pytest.approx([-0.02, -0.012, -0.004, 0.004, 0.012, 0.02])
