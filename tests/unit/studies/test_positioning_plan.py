"""What the positioning study commands: cycles from both sides, one-sided approaches, readings, limits."""

from itertools import pairwise
from pathlib import Path

import pytest
from machine_files import text_of, write_controller

from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.program import check_program
from servo_ctrl.config.program_model import DwellStep, MoveStep
from servo_ctrl.errors import ServoCtrlError
from studies.wang_2014.plan import (
    AT_100MM,
    DOWN,
    OVER_TRAVEL,
    READ_S,
    SERIES,
    UP,
    Plan,
    plan_series,
    stage_machine,
)
from studies.wang_2014.stages import STAGES

STAGE = Path(__file__).parents[3] / "machines" / "precision_stage"
RUNS = 2


def plan_of(name: str, series: str = "over_travel", seed: int = 1) -> Plan:
    stage = STAGES[name]
    return plan_series(stage_machine(STAGE, stage), stage, SERIES[series], RUNS, seed)


def places(plan: Plan) -> list[tuple[float, bool]]:
    """Where the axis goes, millimetres, and whether it is read there."""
    steps = plan.program.steps
    return [
        (step.to_mm["x"], place + 1 in plan.visits)
        for place, step in enumerate(steps)
        if isinstance(step, MoveStep)
    ]


def test_every_target_is_read_from_both_sides_in_every_run() -> None:
    visits = list(plan_of("smoothed").visits.values())
    targets = range(len(OVER_TRAVEL.targets_mm))
    assert [(v.run, v.target, v.direction) for v in visits] == [
        (run, target, direction)
        for run in range(RUNS)
        for direction in (UP, DOWN)
        for target in (targets if direction == UP else reversed(targets))
    ]


def test_targets_are_approached_from_the_side_of_the_cycle_or_always_from_below() -> None:
    two_sided, one_sided = (places(plan_of(name)) for name in ("uncompensated", "open_loop"))
    for way, expected in ((two_sided, {True, False}), (one_sided, {True})):
        from_below = {here > before for (before, _), (here, read) in pairwise(way) if read}
        assert from_below == expected


def test_the_reading_ends_a_rest_of_the_same_length_in_every_stage() -> None:
    for name in STAGES:
        plan = plan_of(name, "at_100mm")
        rests = [plan.program.steps[step] for step in plan.visits]
        assert len(rests) == 2 * RUNS
        assert {rest.seconds for rest in rests if isinstance(rest, DwellStep)} == {READ_S}


def test_the_profile_is_that_of_the_stage() -> None:
    for name, profile in (("sampled_dual_loop", "trapezoidal"), ("smoothed", "s_curve")):
        steps = plan_of(name).program.steps
        assert {step.profile for step in steps if isinstance(step, MoveStep)} == {profile}


def test_waits_are_drawn_by_lot_within_bounds_and_by_the_seed() -> None:
    def waits(seed: int) -> list[float]:
        return [
            step.seconds
            for step in plan_of("smoothed", seed=seed).program.steps
            if isinstance(step, DwellStep) and step.label == "wait"
        ]

    assert waits(1) == waits(1) != waits(2)
    assert 0.0 < min(waits(1)) < max(waits(1)) <= 0.1


@pytest.mark.parametrize("name", list(STAGES))
@pytest.mark.parametrize("series", list(SERIES))
def test_every_stage_stays_within_the_limits_of_the_machine(name: str, series: str) -> None:
    machine = stage_machine(STAGE, STAGES[name])
    assert check_program(plan_of(name, series).program, machine)


def test_a_stage_enables_what_its_name_lists() -> None:
    for stage in STAGES.values():
        params = axis_params(stage_machine(STAGE, stage), "x")
        assert params.sampled.enabled == stage.sampled
        assert params.position_loop.scale_feedback == stage.continuous
        if stage.sampled:
            assert params.sampled.smooth == stage.smooth


def test_uneven_targets_are_spread_over_the_turn_of_the_screw() -> None:
    phases = sorted(target % 5.0 for target in SERIES["irregular"].targets_mm)
    gaps = [after - before for before, after in pairwise(phases)]
    assert max(gaps) < 1.5
    assert {target % 5.0 for target in OVER_TRAVEL.targets_mm + AT_100MM.targets_mm} == {0.0}


def test_a_machine_without_what_is_compared_is_refused(tmp_path: Path) -> None:
    text = text_of(STAGE / "controller.toml")
    write_controller(tmp_path, text[: text.index("[axis.x.sampled_dual_loop]")])
    with pytest.raises(ServoCtrlError, match=r"axis\.x: sampled_dual_loop and screw_compensation"):
        stage_machine(tmp_path, STAGES["smoothed"])
