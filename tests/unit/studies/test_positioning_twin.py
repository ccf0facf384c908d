"""The positioning study in the batch twin: split and whole rollouts, scale and truth, each stage's effect."""

from pathlib import Path

import numpy as np
import pytest

from hil_sim.config import build_plant, load_plant
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.program import program_segments
from servo_ctrl.config.steps import program_steps
from servo_ctrl.learned.store import ScrewStore
from servo_ctrl.learning.screw import ScrewLearned, error_table
from studies.wang_2014.plan import OVER_TRAVEL, plan_series, stage_machine
from studies.wang_2014.readings import Reading
from studies.wang_2014.stages import STAGES
from studies.wang_2014.twin_study import Twin, learned_in_twin, positioned, study
from twin.axis_rollout import AxisRollout
from twin.rollout import rollout

STAGE = Path(__file__).parents[3] / "machines" / "precision_stage"
SHORT = OVER_TRAVEL._replace(targets_mm=(5.0, 12.5))
RUNS = 3
COUNT_M = 0.5e-6


@pytest.fixture(scope="module")
def twin() -> Twin:
    return Twin(STAGE, load_plant(STAGE))


@pytest.fixture(scope="module")
def learned(twin: Twin, tmp_path_factory: pytest.TempPathFactory) -> ScrewLearned:
    store = tmp_path_factory.mktemp("learned")
    found = learned_in_twin(twin, STAGES["screw_table"], store)
    stored = ScrewStore(store, stage_machine(STAGE, STAGES["screw_table"])).active("x")
    assert stored is not None
    assert stored.learned == found, "what the daemon will read is what was learned"
    return found


def read(twin: Twin, name: str) -> list[Reading]:
    return positioned(twin, STAGES[name], SHORT, RUNS, lambda: None)


def largest_m(readings: list[Reading]) -> float:
    return max(abs(reading.interferometer_m) for reading in readings)


def test_readings_are_those_of_a_rollout_in_one_go(twin: Twin) -> None:
    stage = STAGES["smoothed"]
    machine = stage_machine(STAGE, stage)
    plan = plan_series(machine, stage, SHORT, RUNS)
    segments = list(program_segments(program_steps(plan.program, machine), machine, [0.0]))
    moving = [
        np.concatenate([getattr(segment, name)[:, 0] for segment in segments])
        for name in ("position_m", "velocity_m_s", "acceleration_m_s2", "force_offset_n")
    ]
    reference = np.vstack((np.zeros((50, 4)), np.column_stack(moving)))
    whole = rollout(machine, twin.plant, {"x": axis_params(machine, "x")}, {"x": reference})
    ends = 50 + np.cumsum([len(segment.position_m) for segment in segments]) - 1
    for reading, step in zip(read(twin, "smoothed"), plan.visits, strict=True):
        row = ends[step]
        assert reading.scale_m == whole["x.scale_position_m"][row] - reading.target_mm * 1e-3
        assert reading.time_s == pytest.approx(whole["time_s"][row] + machine.period_s)


def test_other_parameters_count_from_the_next_cycle_on(twin: Twin) -> None:
    machine = stage_machine(STAGE, STAGES["uncompensated"])
    params = axis_params(machine, "x")
    plant = build_plant(twin.plant)
    axis = AxisRollout(machine, twin.plant, "x", params, plant)
    axis.rows(np.zeros((20, 4)))
    loop = params.position_loop._replace(kp_1_s=0.0)
    axis.change_params(params._replace(position_loop=loop, output=1))  # nothing moves it now
    rows = axis.rows(np.column_stack((np.full(200, 1e-4), np.zeros((200, 3)))))
    assert np.ptp(rows["motor_position_m"]) < 1e-7


def test_scale_and_interferometer_differ_by_the_counts_of_the_scale(twin: Twin) -> None:
    for reading in read(twin, "uncompensated"):
        # half a count where it reads, and half where it was set to zero
        assert abs(reading.scale_m - reading.interferometer_m) <= COUNT_M


def test_repeats_begin_where_the_one_before_ended_and_differ(twin: Twin) -> None:
    found = [reading for reading in read(twin, "sampled_dual_loop") if reading.visit.target == 1]
    up = [reading.interferometer_m for reading in found if reading.visit.direction == 0]
    assert len(set(up)) == RUNS


def test_corrections_at_the_end_point_take_away_lead_error_and_lost_motion(twin: Twin) -> None:
    assert largest_m(read(twin, "smoothed")) < 0.3 * largest_m(read(twin, "s_curve_alone"))


def test_the_learned_screw_table_removes_the_error_without_the_scale(
    twin: Twin, learned: ScrewLearned
) -> None:
    play_m = 2.0 * float(build_plant(twin.plant).params[0]["backlash"]["play_m"])
    assert learned.lost_motion_m > play_m, "the play, and what friction winds up"
    assert learned.after_m < 0.1 * learned.before_m
    assert np.ptp(error_table(learned)[1]) > 10e-6
    with_table = largest_m(read(twin._replace(screw=learned), "screw_table"))
    assert with_table < 0.2 * largest_m(read(twin, "s_curve_alone"))


def test_stages_side_by_side_read_what_each_reads_alone(twin: Twin) -> None:
    stages, shares = [STAGES[name] for name in ("uncompensated", "smoothed")], []
    together = study(twin, stages, [SHORT], RUNS, shares.append)
    assert together == [reading for stage in stages for reading in read(twin, stage.name)]
    assert shares == pytest.approx([done / 6 for done in range(1, 7)])
