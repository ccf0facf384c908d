"""During learning, commands that move the axes are refused with a reason, but never a stop."""

from pathlib import Path

import pytest
from learning_stand import STROKES, LearningStand, short_learning

from servo_ctrl.commands.command import Command, CommandRequest, CommandResult, Refusal
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.program_model import ProgramConfig

LEARNING_FIRST = "an axis is learning; pause or abort it first"
REFUSED = {
    Command.START_LEARNING: "learning is {state} already; abort it first",
    **dict.fromkeys(
        (
            Command.ENABLE,
            Command.HOME,
            Command.STEP_FORWARD,
            Command.STEP_BACKWARD,
            Command.TOUCH_OFF,
            Command.CLEAR_OFFSET,
            Command.START_PROGRAM,
            Command.HOLD_PROGRAM,
            Command.RESUME_PROGRAM,
            Command.ABORT_PROGRAM,
            Command.ROLL_BACK,
            Command.ROLL_BACK_SCREW,
            Command.ROLL_BACK_WAVEFORM,
        ),
        LEARNING_FIRST,
    ),
}
STOPS = (Command.QUICK_STOP, Command.DISABLE)
OF_LEARNING = {Command.ABORT_LEARNING, Command.PAUSE_LEARNING, Command.RESUME_LEARNING}
SWITCHES = {
    command for command in Command if command.name.endswith(("COMPENSATION", "OBSERVER", "SCREW", "WAVEFORM"))
}
ROUND = '[[step]]\nkind = "circle"\nlabel = "round"\nradius_mm = 5.0\nfeed_mm_min = 600.0\nturns = 1.0\n'


@pytest.fixture(params=[LearningState.RUNNING, LearningState.PAUSING])
def learning(
    machine_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> LearningStand:
    """In the middle of a stroke with a pulse; one is the last before a pause."""
    short_learning(monkeypatch)
    made = LearningStand(machine_file, tmp_path / "learned")
    assert made.handler.execute(CommandRequest(Command.START_LEARNING, "x")).accepted
    made.play()
    if request.param is LearningState.PAUSING:
        assert made.handler.execute(CommandRequest(Command.PAUSE_LEARNING)).accepted
    made.play(50)
    assert made.status.learning.state is request.param
    return made


@pytest.fixture
def program(machine_file: Path, tmp_path: Path) -> ProgramConfig:
    path = tmp_path / "round.toml"
    path.write_text(ROUND, encoding="utf-8")
    return load_program(path, load_machine(machine_file))


def undisturbed(made: LearningStand, state: LearningState, stroke: object) -> bool:
    """The stroke is being made as if nobody had asked."""
    machine = made.machine
    return (machine.stage, machine.program, machine.interrupted, machine.events) == (
        Stage.RUNNING,
        stroke,
        0,
        [],
    ) and made.status.learning.state is state


def test_every_command_that_operates_the_machine_is_refused_with_what_to_do(learning: LearningStand) -> None:
    state, stroke = learning.status.learning.state, learning.machine.program
    for command, reason in REFUSED.items():
        result = learning.handler.execute(CommandRequest(command))
        assert result == CommandResult(Refusal.WRONG_STATE, reason.format(state=state.name.lower())), (
            command.name
        )
        assert undisturbed(learning, state, stroke), command.name
    assert set(Command) == {*REFUSED, *STOPS, *OF_LEARNING, *SWITCHES}, "each command is one of these"
    if state is LearningState.RUNNING:
        for _ in STROKES[1:]:
            learning.play()
        assert learning.status.learning.state is LearningState.DONE, "it has lost nothing by the refusals"


def test_jogging_and_loading_a_program_are_refused_too(
    learning: LearningStand, program: ProgramConfig
) -> None:
    state, stroke = learning.status.learning.state, learning.machine.program
    handler = learning.handler
    for result in (
        handler.jog("x", 0.01),
        handler.jog_step("x", 0.001),
        handler.touch_off("x", 0.0),
        handler.load_program(program),
    ):
        assert result == CommandResult(Refusal.WRONG_STATE, LEARNING_FIRST)
        assert undisturbed(learning, state, stroke)
    assert not learning.status.program.loaded


@pytest.mark.parametrize("stop", STOPS)
def test_a_stop_is_never_refused(learning: LearningStand, stop: Command) -> None:
    assert learning.handler.execute(CommandRequest(stop)).accepted
    assert learning.machine.events == [
        {Command.QUICK_STOP: "quick stop by the operator", Command.DISABLE: "switched off by the operator"}[
            stop
        ]
    ]


def test_switches_of_compensation_act_on_no_stroke_that_is_being_made(learning: LearningStand) -> None:
    state, stroke = learning.status.learning.state, learning.machine.program
    for command in (Command.DISABLE_COMPENSATION, Command.ENABLE_COMPENSATION):
        assert learning.handler.execute(CommandRequest(command, "x")).accepted
        assert learning.pulse("x").enabled, "that of the stroke"
        assert undisturbed(learning, state, stroke)
