"""The sequence of one drive, from whatever it is to servo and back to powerless: a pure function.

    TAKING_OVER -> SWITCHING_ON -> HOMING -> SETTLING -> SERVO     (HOMING only with a homing method)
    TAKING_OVER -> AWAITING_REST -> SWITCHING_ON                   (where the axis moves)
    SERVO -> HOMING                                                (homed anew)
    any -> QUICK_STOPPING -> DISABLING -> OFF,  any -> DISABLING -> OFF,  any -> LOST

A drive that is found enabled follows somebody else, or nobody: it brakes first. A drive that leaves
operation enabled by itself is not led again. An axis that moves is given power when it rests: where it is
would be no home, and our loop would take it over with an error. One step a cycle. Time is counted in cycles,
every phase that waits is bounded, and mode and controlword are cyclic, so nothing here needs SDO.

Homing moves the drive's coordinates. So a statusword counts as its result only where it is certainly later
than the start of homing, and an axis is taken over only in a cycle that has all inputs of it.

Phases, modes and problems are plain ints here: an enumeration would compile to another type.
"""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from kernels.jit import kernel
from servo_ctrl.cyclic.cia402 import (
    CONTROLWORD_TOWARDS,
    DISABLE_VOLTAGE,
    ENABLE_OPERATION,
    FAULT_RESET,
    HOMING_MASK,
    QUICK_STOP,
    SHUTDOWN,
    START_HOMING,
    DriveState,
    Goal,
    Homing,
    Mode,
    drive_state,
    homing_status,
)

SWITCH_ON_LIMIT_S = 5.0
HOMING_LIMIT_S = 120.0
QUICK_STOP_LIMIT_S = 2.0
DISABLE_LIMIT_S = 0.5
"""Bound the wait in a phase; chosen, as the other numbers here."""
SETTLING_CYCLES = 20
"""Cycles between taking over an axis and calling it ready."""
HOMING_START_CYCLES = 4
"""Cycles in homing mode before bit 4 rises, and after it before a statusword is an answer: a set point
takes one SYNC to the drive and its effect one back. A homed drive reports that until homing starts anew."""
COASTS_M_S = 0.01
"""What is faster goes on for a while without power; a controlled stop ends slower."""
FAULT_RESET_CYCLES = 10
"""Half period of the fault reset bit, which acts by its rising edge."""


class Phase(IntEnum):
    """Where a drive is in its sequence."""

    TAKING_OVER = 0
    AWAITING_REST = 1
    SWITCHING_ON = 2
    HOMING = 3
    SETTLING = 4
    SERVO = 5
    QUICK_STOPPING = 6
    DISABLING = 7
    OFF = 8
    LOST = 9


PHASE_TEXTS: dict[Phase, str] = {
    **{phase: phase.name.lower().replace("_", " ") for phase in Phase},
    Phase.AWAITING_REST: "waiting for rest",
}
"""A phase in words, as the status of a drive has it."""


class Problem(IntEnum):
    """Why a drive cannot go on; the fault policy decides."""

    NONE = 0
    STAYS = 1
    """In a state in which it gets no power, or does not give it up."""
    MOVES = 2
    LEFT = 3
    """Operation enabled, by itself."""
    LEFT_HOMING = 4
    HOMING_ERROR = 5
    HOMING_TOO_LONG = 6
    STAYS_IN_MODE = 7


class Route(NamedTuple):
    """The fixed part of a drive's sequence: its mode, whether it is homed, and the period in seconds."""

    mode: int
    homing: bool
    period_s: float
    mode_switch_disabled: bool = False
    """It takes another mode only without power."""
    homed_by_bit_12: bool = False
    """Statusword bit 10 does not tell the end of homing."""


class Sequence(NamedTuple):
    """Where the sequence is, for how many cycles, and the mode of operation that goes with it."""

    phase: int
    cycles: int
    mode: int


class Step(NamedTuple):
    """The result of one cycle of the sequence."""

    sequence: Sequence
    controlword: int
    problem: int
    sent_mode: int
    """Mode of operation that goes out; that of the sequence, or the one before while that is kept."""


UNDER_CONTROL = frozenset({Phase.SETTLING, Phase.SERVO})
"""Phases in which our loop leads the axis."""
HOMED = frozenset({Phase.SETTLING, Phase.TAKING_OVER})
"""Where homing that has come to its end leads to."""
UNKNOWN_MODE = 0x100
"""Shown by a drive that does not tell its mode (6061h, eight bits)."""

_STATES = tuple(DriveState)
_STATE_OF = np.array([_STATES.index(drive_state(low)) for low in range(0x80)])
"""Place among the states, by the statusword's low seven bits."""
_CONTROLWORD = np.array([[CONTROLWORD_TOWARDS[goal][state] for state in _STATES] for goal in Goal])
_ENABLED, _DISABLED, _QUICK_STOPPED = (tuple(Goal).index(goal) for goal in Goal)
_HOMING_BITS = np.array([homing_status(bits << 10).value for bits in range(0x10)])
"""Progress of homing by bits 10 to 13 of the statusword."""
_COMPLETED, _ATTAINED_MOVING = Homing.COMPLETED.value, Homing.ATTAINED_MOVING.value
_ERROR, _ERROR_MOVING = Homing.ERROR.value, Homing.ERROR_MOVING.value
_NOT_READY = _STATES.index(DriveState.NOT_READY_TO_SWITCH_ON)
_SWITCHED_ON = _STATES.index(DriveState.SWITCHED_ON)
_OPERATION_ENABLED = _STATES.index(DriveState.OPERATION_ENABLED)
_QUICK_STOP_ACTIVE = _STATES.index(DriveState.QUICK_STOP_ACTIVE)
_FAULT_REACTION_ACTIVE = _STATES.index(DriveState.FAULT_REACTION_ACTIVE)
_TAKING_OVER, _AWAITING_REST, _SWITCHING_ON = (
    int(phase) for phase in (Phase.TAKING_OVER, Phase.AWAITING_REST, Phase.SWITCHING_ON)
)
_HOMING, _SETTLING, _SERVO = (int(phase) for phase in (Phase.HOMING, Phase.SETTLING, Phase.SERVO))
_QUICK_STOPPING, _DISABLING = int(Phase.QUICK_STOPPING), int(Phase.DISABLING)
_OFF, _LOST = int(Phase.OFF), int(Phase.LOST)
_HOMING_MODE = int(Mode.HOMING)
_NONE, _STAYS, _MOVES = int(Problem.NONE), int(Problem.STAYS), int(Problem.MOVES)
_LEFT, _LEFT_HOMING = int(Problem.LEFT), int(Problem.LEFT_HOMING)
_HOMING_ERROR, _HOMING_TOO_LONG = int(Problem.HOMING_ERROR), int(Problem.HOMING_TOO_LONG)
_STAYS_IN_MODE = int(Problem.STAYS_IN_MODE)


def begin(route: Route, *, homed: bool = False) -> Sequence:
    """Begin the sequence of a drive in any state; one that is homed already is not homed again."""
    return Sequence(_TAKING_OVER, 0, _HOMING_MODE if route.homing and not homed else route.mode)


def home() -> Sequence:
    """Go from servo to homing, and back."""
    return Sequence(_HOMING, 0, _HOMING_MODE)


def brake(sequence: Sequence) -> Sequence:
    """Go from any phase to the drive's own quick stop, in the mode it is in."""
    return Sequence(_QUICK_STOPPING, 0, sequence.mode)


@kernel
def release(sequence: Sequence) -> Sequence:
    """Go from any phase to power off."""
    return Sequence(_DISABLING, 0, sequence.mode)


def lose(sequence: Sequence) -> Sequence:
    """Give a drive up that does not respond, from any phase; as it may receive our frames, they say brake."""
    return Sequence(_LOST, 0, sequence.mode)


def problem_text(problem: int, statusword: int, mode_shown: int = UNKNOWN_MODE, mode: int = 0) -> str:
    """Say a `Problem` of a drive that reports this and should be in `mode`, "" where there is none."""
    state = drive_state(statusword).value
    return (
        "",
        f"stays in {state}",
        "is not switched on: its axis moves",
        f"is in {state}",
        f"is in {state} during homing",
        "reports a homing error",
        f"did not finish homing in {HOMING_LIMIT_S:g} s",
        f"stays in mode {mode_shown} instead of {mode}",
    )[problem]


@kernel
def advance(
    route: Route, sequence: Sequence, statusword: int, whole: bool, age: int, rests: bool, mode_shown: int
) -> Step:
    """Return the next step, given the drive's statusword of this cycle.

    `whole`: all inputs of the axis have come in it; `age`: cycles that the statusword may be old; `rests`:
    whether the axis stands still and may be given power; `mode_shown`: the mode that the drive says it is in.
    """
    state = _STATE_OF[statusword & 0x7F]
    phase = sequence.phase
    if phase == _SERVO and state == _OPERATION_ENABLED:  # nearly every cycle
        step = _step(sequence, ENABLE_OPERATION, _NONE)
    elif phase in (_SETTLING, _SERVO):
        step = _servo(route, sequence, state, mode_shown)
    elif phase in (_TAKING_OVER, _AWAITING_REST):
        step = _take_over(route, sequence, state, whole, rests)
    elif phase == _SWITCHING_ON:
        step = _switch_on(route, sequence, state, whole, mode_shown)
    elif phase == _HOMING:
        step = _home(route, sequence, statusword, whole, age)
    elif phase == _QUICK_STOPPING:
        step = _quick_stop(route, sequence, state)
    elif phase in (_DISABLING, _OFF):
        step = _disable(route, sequence, state)
    else:
        step = _step(sequence, QUICK_STOP, _NONE)
    return step


@kernel
def _step(sequence: Sequence, controlword: int, problem: int) -> Step:
    """Go on in the mode of the sequence."""
    return Step(sequence, controlword, problem, sequence.mode)


@kernel
def _take_over(route: Route, sequence: Sequence, state: int, whole: bool, rests: bool) -> Step:
    """Wait until a drive that is found with power has stopped and given it up, and until its axis rests.

    Once power is on its way it is not called back: an answer may be some cycles old.
    """
    waited_s = sequence.cycles * route.period_s
    if _powered(state) or state == _NOT_READY:
        goal = _QUICK_STOPPED if waited_s <= QUICK_STOP_LIMIT_S else _DISABLED
        mode = _HOMING_MODE if route.homing and route.mode_switch_disabled else sequence.mode
        return Step(_waiting(sequence), _CONTROLWORD[goal, state], _too_long(waited_s), mode)
    if not rests:
        problem = _MOVES if waited_s > SWITCH_ON_LIMIT_S else _NONE
        return _step(Sequence(_AWAITING_REST, sequence.cycles + 1, sequence.mode), SHUTDOWN, problem)
    return _switch_on(route, Sequence(_SWITCHING_ON, 0, sequence.mode), state, whole, UNKNOWN_MODE)


@kernel
def _switch_on(route: Route, sequence: Sequence, state: int, whole: bool, mode_shown: int) -> Step:
    cycles = sequence.cycles
    homing = sequence.mode == _HOMING_MODE
    if state == _OPERATION_ENABLED and _other_mode(sequence, mode_shown):
        return _step(_waiting(sequence), ENABLE_OPERATION, _other_mode_too_long(route, sequence))
    if state == _OPERATION_ENABLED and (homing or whole):
        following = _HOMING if homing else _SETTLING
        return _step(Sequence(following, 0, sequence.mode), ENABLE_OPERATION, _NONE)
    controlword = _CONTROLWORD[_ENABLED, state]
    if controlword == FAULT_RESET and cycles // FAULT_RESET_CYCLES % 2 == 0:
        controlword = DISABLE_VOLTAGE  # low first: the reset is the edge
    return _step(_waiting(sequence), controlword, _too_long(cycles * route.period_s))


@kernel
def _other_mode(sequence: Sequence, mode_shown: int) -> bool:
    """Whether the drive says that it is in another mode."""
    return mode_shown not in (UNKNOWN_MODE, sequence.mode)


@kernel
def _other_mode_too_long(route: Route, sequence: Sequence) -> int:
    return _STAYS_IN_MODE if sequence.cycles * route.period_s > SWITCH_ON_LIMIT_S else _NONE


@kernel
def _too_long(waited_s: float) -> int:
    return _STAYS if waited_s > SWITCH_ON_LIMIT_S else _NONE


@kernel
def _home(route: Route, sequence: Sequence, statusword: int, whole: bool, age: int) -> Step:
    cycles = sequence.cycles
    if _STATE_OF[statusword & 0x7F] != _OPERATION_ENABLED:
        return _step(release(sequence), DISABLE_VOLTAGE, _LEFT_HOMING)
    if cycles < HOMING_START_CYCLES:
        return _step(_waiting(sequence), ENABLE_OPERATION, _NONE)
    problem, progress = _NONE, _HOMING_BITS[(statusword & HOMING_MASK) >> 10]
    if route.homed_by_bit_12 and progress == _ATTAINED_MOVING:
        progress = _COMPLETED
    if cycles - age >= 2 * HOMING_START_CYCLES:
        if progress == _COMPLETED and whole:
            if route.mode_switch_disabled:
                return Step(Sequence(_TAKING_OVER, 0, route.mode), QUICK_STOP, _NONE, _HOMING_MODE)
            return _step(Sequence(_SETTLING, 0, route.mode), ENABLE_OPERATION, _NONE)
        if progress in (_ERROR, _ERROR_MOVING):
            problem = _HOMING_ERROR
    if cycles * route.period_s > HOMING_LIMIT_S and problem == _NONE:
        problem = _HOMING_TOO_LONG
    return _step(_waiting(sequence), ENABLE_OPERATION | START_HOMING, problem)


@kernel
def _servo(route: Route, sequence: Sequence, state: int, mode_shown: int) -> Step:
    if state != _OPERATION_ENABLED:
        return _step(release(sequence), DISABLE_VOLTAGE, _LEFT)
    if sequence.cycles + 1 < SETTLING_CYCLES:
        return _step(_waiting(sequence), ENABLE_OPERATION, _NONE)
    if _other_mode(sequence, mode_shown):
        return _step(_waiting(sequence), ENABLE_OPERATION, _other_mode_too_long(route, sequence))
    return _step(Sequence(_SERVO, 0, sequence.mode), ENABLE_OPERATION, _NONE)


@kernel
def _quick_stop(route: Route, sequence: Sequence, state: int) -> Step:
    braking = state in (_OPERATION_ENABLED, _QUICK_STOP_ACTIVE)
    if braking and sequence.cycles * route.period_s <= QUICK_STOP_LIMIT_S:
        return _step(_waiting(sequence), _CONTROLWORD[_QUICK_STOPPED, state], _NONE)
    return _step(release(sequence), _CONTROLWORD[_DISABLED, state], _NONE)


@kernel
def _disable(route: Route, sequence: Sequence, state: int) -> Step:
    powered = _powered(state) or state == _SWITCHED_ON
    in_time = sequence.phase == _DISABLING and sequence.cycles * route.period_s <= DISABLE_LIMIT_S
    following = _waiting(sequence) if powered and in_time else Sequence(_OFF, 0, sequence.mode)
    return _step(following, _CONTROLWORD[_DISABLED, state], _NONE)


@kernel
def _powered(state: int) -> bool:
    """Whether the motor has current in this state."""
    return state in (_OPERATION_ENABLED, _QUICK_STOP_ACTIVE, _FAULT_REACTION_ACTIVE)


@kernel
def _waiting(sequence: Sequence) -> Sequence:
    return Sequence(sequence.phase, sequence.cycles + 1, sequence.mode)
