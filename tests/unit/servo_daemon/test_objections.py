"""What a client says against a request by the status is what the controller refuses it with."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from ideal_drives import ROUND, OperatedStand
from learning_stand import LearningStand

from servo_ctrl.commands.command import Command, CommandRequest, CommandResult
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.local_messages import TuningRun
from servo_ctrl.commands.objections import CHECKS, NOTHING_IN_USE, objection
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.program_model import ProgramConfig

Operate = Callable[..., OperatedStand]
Made = Any
"""A machine with `handler` and `status`."""
LEFT_TO_HANDLERS = {
    *NOTHING_IN_USE.values(),
    "the axes have no homing method (homing_method = 0)",
    "axis x has no friction_compensation section",
    "axis x is in mode csp; it is tuned in mode cst",
}
"""Of the axes, not of the state."""
OF_THE_AXES = {Command.HOME, Command.START_LEARNING, "tuning_run"}
"""Requests that one of these refuses on a machine of ideal drives."""
TRIAL = TuningRun(axis="x", control={}, trial=True)
JOGS = frozenset({"jog", "jog_step"})


def refusal_of(made: Made, request: object, program: ProgramConfig, line: Path) -> str:
    """Make a request of the real handler; its refusal, "" where it is accepted."""
    handler = made.handler
    if isinstance(request, Command):
        axis = "x" if request is Command.START_LEARNING else ""
        result = handler.execute(CommandRequest(request, axis))
    elif request == "jog":
        result = handler.jog("x", 1e-3)
    elif request == "jog_step":
        result = handler.jog_step("x", 1e-4)
    elif request == "touch_off":
        result = handler.touch_off("x", 0.0)
    elif request == "run_line":
        result = handler.run_line(load_program(line, made.config, reading=handler.reading_of_line()))
    elif request == "tuning_run":
        result = made.services.tuning.objection(TRIAL) or CommandResult()
    else:
        assert request == "load_program"
        result = handler.load_program(program)
    reason: str = result.reason
    return reason


@pytest.fixture
def line(tmp_path: Path) -> Path:
    path = tmp_path / "line.ngc"
    path.write_text("G21 G91 G1 X0.1 F60\n", encoding="utf-8")
    return path


def compare(
    make: Callable[[], Made], program: ProgramConfig, line: Path, but: frozenset[object] = frozenset()
) -> None:
    """Compare all requests; a machine that has accepted one is another one afterwards."""
    made, compared = make(), set()
    for request in CHECKS.keys() - but:
        said = objection(made.status, request)
        refused = refusal_of(made, request, program, line)
        if refused in LEFT_TO_HANDLERS:
            continue
        assert said == refused, request
        compared.add(request)
        if not refused:
            made = make()
    assert compared >= CHECKS.keys() - but - NOTHING_IN_USE.keys() - OF_THE_AXES


def standing_by(enabled: Operate, operated: Operate, program: ProgramConfig) -> OperatedStand:
    made = operated()
    made.run(3)
    return made


def ready(enabled: Operate, operated: Operate, program: ProgramConfig) -> OperatedStand:
    return enabled()


def loaded(enabled: Operate, operated: Operate, program: ProgramConfig) -> OperatedStand:
    made = enabled()
    assert made.handler.load_program(program).accepted
    return made


def running(enabled: Operate, operated: Operate, program: ProgramConfig) -> OperatedStand:
    made = loaded(enabled, operated, program)
    assert made.ask(Command.START_PROGRAM).accepted
    made.run(50)
    return made


def held(enabled: Operate, operated: Operate, program: ProgramConfig) -> OperatedStand:
    made = running(enabled, operated, program)
    assert made.ask(Command.HOLD_PROGRAM).accepted
    return made


def jogging(enabled: Operate, operated: Operate, program: ProgramConfig) -> OperatedStand:
    made = loaded(enabled, operated, program)
    assert made.handler.jog("x", 1e-3).accepted
    made.run(10)
    return made


def stopping(enabled: Operate, operated: Operate, program: ProgramConfig) -> OperatedStand:
    made = running(enabled, operated, program)
    made.ask(Command.QUICK_STOP)
    made.run(1)
    return made


@pytest.mark.parametrize("state", [standing_by, ready, loaded, running, held, jogging, stopping])
def test_the_status_tells_the_refusal_of_a_machine_that_is_operated(
    state: Callable[..., OperatedStand],
    enabled: Operate,
    operated: Operate,
    round_program: ProgramConfig,
    line: Path,
) -> None:
    jogs = JOGS if state is jogging else frozenset()  # a jog that goes on is renewed
    compare(lambda: state(enabled, operated, round_program), round_program, line, jogs)


@pytest.fixture
def program(machine_file: Path, tmp_path: Path) -> ProgramConfig:
    path = tmp_path / "round.toml"
    path.write_text(ROUND, encoding="utf-8")
    return load_program(path, load_machine(machine_file))


@pytest.mark.parametrize("wanted", [LearningState.RUNNING, LearningState.PAUSING, LearningState.PAUSED])
def test_the_status_tells_the_refusal_of_a_machine_that_learns(
    stand: Callable[..., LearningStand],
    wanted: LearningState,
    program: ProgramConfig,
    line: Path,
    tmp_path: Path,
) -> None:
    def learning() -> LearningStand:
        shutil.rmtree(tmp_path / "learned", ignore_errors=True)  # or it would resume the run before
        made = stand(program=program)
        assert made.handler.execute(CommandRequest(Command.START_LEARNING, "x")).accepted
        made.play(50)
        if wanted is not LearningState.RUNNING:
            assert made.handler.execute(CommandRequest(Command.PAUSE_LEARNING)).accepted
        if wanted is LearningState.PAUSED:
            made.play()
        assert made.status.learning.state is wanted
        return made

    compare(learning, program, line, frozenset({Command.HOME}))  # this machine cannot home


@pytest.mark.parametrize("stage", [stage for stage in Stage if stage not in {Stage.READY, Stage.STANDBY}])
def test_the_status_tells_the_refusal_in_every_other_stage(
    stand: Callable[..., LearningStand], stage: Stage, program: ProgramConfig, line: Path
) -> None:
    def in_stage() -> LearningStand:
        made = stand(program=program)
        made.machine.stage = stage
        return made

    idle = frozenset({Command.ABORT_PROGRAM})  # nothing moves this machine, whatever its stage
    compare(in_stage, program, line, idle)


@pytest.mark.parametrize("override", ["", "feed_override_percent", "rapid_override_percent"])
def test_the_status_tells_whether_a_machine_that_is_ready_can_be_tuned(
    stand: Callable[..., LearningStand], override: str
) -> None:
    made = stand()
    if override:
        assert made.handler.change(override, 50.0).accepted
    refused = made.services.tuning.objection(TRIAL)
    assert objection(made.status, "tuning_run") == ("" if refused is None else refused.reason)
    assert bool(refused) == bool(override)
