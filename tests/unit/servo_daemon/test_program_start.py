"""The program of a run, the first time and again, from where the axes are."""

import asyncio
from pathlib import Path

import pytest
from learning_stand import LearningStand, short_learning

from servo_ctrl.commands.command import Command, CommandRequest, Refusal
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.daemon.set_points import motion_plan

AGAIN = CommandRequest(Command.START_PROGRAM)
LEFT_BY_60_MM = """
[[step]]
kind = "s_shape"
label = "there and back"
axis = "x"
distance_mm = -60.0
velocity_mm_s = 150.0
acceleration_mm_s2 = 500.0
"""


@pytest.fixture
def program(machine_file: Path, tmp_path: Path) -> ProgramConfig:
    path = tmp_path / "program.toml"
    path.write_text(LEFT_BY_60_MM, encoding="utf-8")
    return load_program(path, load_machine(machine_file))


def test_program_is_started_once_the_axes_are_ready_and_again_on_command(
    machine_file: Path, tmp_path: Path, program: ProgramConfig
) -> None:
    made = LearningStand(machine_file, tmp_path / "learned", program=program)
    assert made.machine.program is None
    made.services.on_ready()
    assert made.machine.stage is Stage.RUNNING
    verdict = made.handler.execute(AGAIN)
    assert (verdict.refusal, verdict.reason) == (Refusal.WRONG_STATE, "the machine is running, not ready")
    made.play()
    assert made.services.completed
    assert made.handler.execute(AGAIN).accepted
    made.play(5)
    assert not made.services.completed
    assert [span.step for span in made.motion.spans] == [0, 1]


def test_program_that_does_not_fit_any_more_is_refused_and_the_axes_stay(
    machine_file: Path, tmp_path: Path, program: ProgramConfig
) -> None:
    made = LearningStand(machine_file, tmp_path / "learned", program=program)
    made.machine.at_m = [-0.05, 0.0]
    verdict = made.handler.execute(AGAIN)
    assert verdict.refusal is Refusal.OUT_OF_RANGE
    assert "beyond the limit -100 mm" in verdict.reason
    assert (made.machine.stage, made.machine.events) == (Stage.READY, [])
    assert made.machine.notes == [f"the program was not started again: {verdict.reason}"]


def test_program_that_does_not_fit_the_first_time_stops_the_machine(
    machine_file: Path, tmp_path: Path, program: ProgramConfig
) -> None:
    made = LearningStand(machine_file, tmp_path / "learned", program=program)
    made.machine.at_m = [-0.05, 0.0]
    made.services.on_ready()
    assert len(made.machine.events) == 1
    assert "beyond the limit -100 mm" in made.machine.events[0]


def test_without_a_program_there_is_none_to_start(machine_file: Path, tmp_path: Path) -> None:
    made = LearningStand(machine_file, tmp_path / "learned")
    verdict = made.handler.execute(AGAIN)
    assert verdict.refusal is Refusal.WRONG_STATE
    assert verdict.reason.startswith("there is no program")


async def test_nothing_else_may_begin_while_the_program_is_being_planned(
    machine_file: Path, tmp_path: Path, program: ProgramConfig
) -> None:
    made = LearningStand(machine_file, tmp_path / "learned", program=program, lockstep=False)
    made.services.on_ready()
    assert made.machine.stage is Stage.READY
    verdict = made.handler.execute(CommandRequest(Command.START_LEARNING, "x"))
    assert (verdict.refusal, verdict.reason) == (
        Refusal.WRONG_STATE,
        "a program is being checked; wait for its end",
    )
    assert made.handler.execute(AGAIN).refusal is Refusal.WRONG_STATE
    task = asyncio.create_task(made.services.worker.run())
    async with asyncio.timeout(30.0):
        await made.services.worker.finish()
    task.cancel()
    assert made.machine.stage is Stage.RUNNING


async def test_learning_that_is_paused_waits_for_a_program_that_is_about_to_start(
    machine_file: Path, tmp_path: Path, program: ProgramConfig, monkeypatch: pytest.MonkeyPatch
) -> None:
    short_learning(monkeypatch)
    made = LearningStand(machine_file, tmp_path / "learned", program=program, lockstep=False)
    task = asyncio.create_task(made.services.worker.run())
    async with asyncio.timeout(30.0):
        made.handler.execute(CommandRequest(Command.START_LEARNING, "x"))
        made.handler.execute(CommandRequest(Command.PAUSE_LEARNING))
        await made.services.worker.finish()
        assert made.status.learning.state is LearningState.PAUSED
        assert made.handler.execute(AGAIN).accepted
        verdict = made.handler.execute(CommandRequest(Command.RESUME_LEARNING))
        assert (verdict.refusal, verdict.reason) == (
            Refusal.WRONG_STATE,
            "a program is being checked; wait for its end",
        )
        await made.services.worker.finish()
    task.cancel()
    assert made.machine.stage is Stage.RUNNING
    assert made.status.learning.state is LearningState.PAUSED


def test_steps_of_weeks_of_production_are_not_all_kept(
    machine_file: Path, tmp_path: Path, program: ProgramConfig, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(motion_plan, "SPANS_KEPT", 10)
    made = LearningStand(machine_file, tmp_path / "learned", program=program)
    made.services.on_ready()
    for _ in range(20):
        made.play()
        made.machine.at_m = [0.0, 0.0]
        assert made.handler.execute(AGAIN).accepted
    made.play()
    assert [span.step for span in made.motion.spans] == list(range(10, 21))
