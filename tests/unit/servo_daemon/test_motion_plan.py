"""What is prepared beside the cycle, so that the cycle has little to do."""

import pytest

from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.motion import program


def test_a_path_is_planned_before_it_is_run(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = load_machine("machines/xy_table")
    plan = MotionPlan(machine, load_program("machines/xy_table/programs/bracket.ngc", machine))
    reference = plan.prepare([0.0, 0.0])

    def too_late(*_arguments: object) -> None:
        pytest.fail("a path was planned within the cycle")

    monkeypatch.setattr(program, "plan_path", too_late)
    cycles = 0
    while reference.advance(cycles) is not None:
        cycles += 1
    assert cycles == plan.cycles
