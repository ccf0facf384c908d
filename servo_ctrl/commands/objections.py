"""Why the controller would refuse a request now, by its published status, in the words of its refusal.

The handlers of `servo_ctrl.daemon` refuse with the sentences of this module; a client shows them where it
offers the request. What the status does not hold, such as the switch at which an axis stands, is left to the
handlers. tests/unit/servo_daemon/test_objections.py compares both.
"""

from collections.abc import Callable, Mapping
from functools import partial

from servo_ctrl.commands.command import Command
from servo_ctrl.commands.learning_status import ACTIVE, MAKING_STROKES, LearningState
from servo_ctrl.commands.local_messages import Do
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.stage import Stage, refused_now

LEARNS = "an axis is learning; pause or abort it first"
BEING_CHECKED = "a program is being checked; wait for its end"
NO_PROGRAM = "there is no program; load one, or name one by `servo-ctrl run --program`"
NOT_RUNNING = "no program is running"
HELD = "the program is held; resume it, or abort it first"
HELD_ALREADY = "the program is held already"
NOT_HELD = "the program is not held"
NOT_READY = "not ready"
NOT_AT_REST = "neither ready nor in standby"
NOT_IN_STANDBY = "not in standby"
OVERRIDDEN = "set both overrides to 100 % for a tuning"
NO_POWER = "and has no power that could be switched off"
NO_LEARNING = {
    Command.PAUSE_LEARNING: "there is no learning to pause",
    Command.RESUME_LEARNING: "there is no learning to resume",
    Command.ABORT_LEARNING: "there is no learning to abort",
}
LEARNING_PERMITS = {
    Command.PAUSE_LEARNING: {LearningState.RUNNING},
    Command.RESUME_LEARNING: {LearningState.PAUSED, LearningState.PAUSING},
    Command.ABORT_LEARNING: ACTIVE,
}
"""States of learning in which a command has an effect."""
NOTHING_IN_USE = {
    Command.ROLL_BACK: "no learned functions are in use",
    Command.ROLL_BACK_SCREW: "no learned screw is in use",
    Command.ROLL_BACK_WAVEFORM: "no learned waveform is in use",
}
"""Of an axis whose result is to be rolled back."""


def learning_already(state: LearningState) -> str:
    """Return why no second learning run begins."""
    return f"learning is {state.name.lower()} already; abort it first"


def no_such_learning(command: Command, state: LearningState) -> str:
    """Return why learning cannot be paused, resumed or aborted in this state."""
    return f"{NO_LEARNING[command]}; learning is {state.name.lower()}"


def objection(status: MachineStatus, request: Command | Do) -> str:
    """Return why the controller would refuse a request in this state; "" where nothing speaks against it."""
    check = CHECKS.get(request)
    return check(status) if check is not None else ""


def _learns(status: MachineStatus) -> str:
    return LEARNS if status.learning.state in MAKING_STROKES else ""


def _checked(status: MachineStatus) -> str:
    return BEING_CHECKED if status.program.preparing else ""


def _occupied(status: MachineStatus) -> str:
    return _learns(status) or _checked(status)


def _unless(status: MachineStatus, stages: set[Stage], wanted: str = NOT_READY) -> str:
    return "" if status.stage in stages else refused_now(status, wanted).reason


def _from_ready(status: MachineStatus) -> str:
    return _occupied(status) or _unless(status, {Stage.READY})


def _tuning_run(status: MachineStatus) -> str:
    settings = status.settings
    overridden = settings.feed_override_percent != 100.0 or settings.rapid_override_percent != 100.0
    return _from_ready(status) or (OVERRIDDEN if overridden else "")


def _at_rest(status: MachineStatus) -> str:
    return _occupied(status) or _unless(status, {Stage.READY, Stage.STANDBY}, NOT_AT_REST)


def _enable(status: MachineStatus) -> str:
    return _occupied(status) or _unless(status, {Stage.STANDBY}, NOT_IN_STANDBY)


def _disable(status: MachineStatus) -> str:
    possible = status.stage.under_way or status.setting_up
    return "" if possible else refused_now(status, NO_POWER).reason


def _start_program(status: MachineStatus) -> str:
    held = HELD if status.program.held else ""
    empty = "" if status.program.loaded else NO_PROGRAM
    return _checked(status) or held or _learns(status) or empty or _unless(status, {Stage.READY})


def _hold_program(status: MachineStatus, *, hold: bool) -> str:
    if status.program.step < 0:
        return _learns(status) or NOT_RUNNING
    return (HELD_ALREADY if hold else NOT_HELD) if status.program.held == hold else ""


def _abort_program(status: MachineStatus) -> str:
    return _learns(status) or ("" if status.stage is Stage.RUNNING else NOT_RUNNING)


def _start_learning(status: MachineStatus) -> str:
    state = status.learning.state
    active = learning_already(state) if state in ACTIVE else ""
    return _checked(status) or active or _unless(status, {Stage.READY})


def _change_learning(status: MachineStatus, *, command: Command) -> str:
    state = status.learning.state
    return "" if state in LEARNING_PERMITS[command] else no_such_learning(command, state)


def _resume_learning(status: MachineStatus) -> str:
    paused = status.learning.state is LearningState.PAUSED
    unready = _unless(status, {Stage.READY}) if paused else ""
    return _checked(status) or unready or _change_learning(status, command=Command.RESUME_LEARNING)


CHECKS: Mapping[Command | Do, Callable[[MachineStatus], str]] = {
    Command.ENABLE: _enable,
    Command.DISABLE: _disable,
    Command.HOME: _from_ready,
    Command.CLEAR_OFFSET: _at_rest,
    "jog": _from_ready,
    "jog_step": _from_ready,
    "touch_off": _from_ready,
    "run_line": _from_ready,
    "tuning_run": _tuning_run,
    "load_program": _at_rest,
    Command.START_PROGRAM: _start_program,
    Command.HOLD_PROGRAM: partial(_hold_program, hold=True),
    Command.RESUME_PROGRAM: partial(_hold_program, hold=False),
    Command.ABORT_PROGRAM: _abort_program,
    Command.START_LEARNING: _start_learning,
    Command.PAUSE_LEARNING: partial(_change_learning, command=Command.PAUSE_LEARNING),
    Command.RESUME_LEARNING: _resume_learning,
    Command.ABORT_LEARNING: partial(_change_learning, command=Command.ABORT_LEARNING),
    **dict.fromkeys(NOTHING_IN_USE, _learns),
}
"""What speaks against a request, by the request; any other one is always possible, as STOP is."""
