"""The sequence of one drive, from any state to servo and back to power off: a pure function.

    TAKING_OVER -> SWITCHING_ON -> HOMING -> SETTLING -> SERVO     (HOMING only with a homing method)
    TAKING_OVER -> AWAITING_REST -> SWITCHING_ON                   (where the axis moves)
    SERVO -> HOMING                                                (homed again)
    any -> QUICK_STOPPING -> DISABLING -> OFF,  any -> DISABLING -> OFF,  any -> LOST

A drive that is found enabled follows another master, or none: it brakes first. A drive that leaves operation
enabled by itself is not commanded again. An axis that moves gets power once it is at rest: its position would
be no home, and our loop would start with an error. One step a cycle. Time is counted in cycles, every wait is
bounded, and mode and controlword are cyclic, so nothing here needs SDO.

Homing moves the drive's coordinates. So a statusword counts as its result only where it is certainly later
than the start of homing, and an axis is taken over only in a cycle that has all inputs of it.
"""

from typing import NamedTuple

from kernels.jit import kernel
from servo_ctrl.cyclic.cia402 import (
    DISABLE_VOLTAGE,
    ENABLE_OPERATION,
    FAULT_RESET,
    HOMING_MASK,
    QUICK_STOP,
    SHUTDOWN,
    START_HOMING,
    Mode,
)
from servo_ctrl.cyclic.cia402_tables import (
    ATTAINED_MOVING,
    COMPLETED,
    CONTROLWORD,
    DISABLED,
    ENABLED,
    ERROR,
    ERROR_MOVING,
    HOMING_PROGRESS,
    NOT_READY,
    OPERATION_ENABLED,
    POWERED,
    QUICK_STOP_ACTIVE,
    QUICK_STOPPED,
    STATE_OF,
    SWITCHED_ON,
)
from servo_ctrl.cyclic.drive_phases import (
    DISABLE_LIMIT_S,
    HOMING_LIMIT_S,
    QUICK_STOP_LIMIT_S,
    SWITCH_ON_LIMIT_S,
    UNKNOWN_MODE,
    Phase,
    Problem,
)

SETTLING_CYCLES = 20
"""Cycles between taking over an axis and calling it ready."""
HOMING_START_CYCLES = 4
"""Cycles in homing mode before bit 4 rises, and after it before a statusword is an answer: a set point
takes one SYNC to the drive and its effect one back. A homed drive reports that until homing starts again."""
COASTS_M_S = 0.01
"""What is faster goes on for a while without power; a controlled stop ends slower."""
FAULT_RESET_CYCLES = 10
"""Half period of the fault reset bit, which acts by its rising edge."""


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


# Members as ints: an enumeration would compile to another type.
(
    _TAKING_OVER,
    _AWAITING_REST,
    _SWITCHING_ON,
    _HOMING,
    _SETTLING,
    _SERVO,
    _QUICK_STOPPING,
    _DISABLING,
    _OFF,
    _LOST,
) = (int(phase) for phase in Phase)
_NONE, _STAYS, _MOVES, _LEFT, _LEFT_HOMING, _HOMING_ERROR, _HOMING_TOO_LONG, _STAYS_IN_MODE = (
    int(problem) for problem in Problem
)
_HOMING_MODE = int(Mode.HOMING)


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


@kernel
def advance(
    route: Route, sequence: Sequence, statusword: int, whole: bool, age: int, rests: bool, mode_shown: int
) -> Step:
    """Return the next step, given the drive's statusword of this cycle.

    `whole`: all inputs of the axis have come in it; `age`: cycles that the statusword may be old; `rests`:
    whether the axis stands still and may be given power; `mode_shown`: the mode that the drive says it is in.
    """
    state = STATE_OF[statusword & 0x7F]
    phase = sequence.phase
    if phase == _SERVO and state == OPERATION_ENABLED:  # nearly every cycle
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
    if POWERED[state] or state == NOT_READY:
        goal = QUICK_STOPPED if waited_s <= QUICK_STOP_LIMIT_S else DISABLED
        mode = _HOMING_MODE if route.homing and route.mode_switch_disabled else sequence.mode
        return Step(_waiting(sequence), CONTROLWORD[goal, state], _too_long(waited_s), mode)
    if not rests:
        problem = _MOVES if waited_s > SWITCH_ON_LIMIT_S else _NONE
        return _step(Sequence(_AWAITING_REST, sequence.cycles + 1, sequence.mode), SHUTDOWN, problem)
    return _switch_on(route, Sequence(_SWITCHING_ON, 0, sequence.mode), state, whole, UNKNOWN_MODE)


@kernel
def _switch_on(route: Route, sequence: Sequence, state: int, whole: bool, mode_shown: int) -> Step:
    cycles = sequence.cycles
    homing = sequence.mode == _HOMING_MODE
    if state == OPERATION_ENABLED and _other_mode(sequence, mode_shown):
        return _step(_waiting(sequence), ENABLE_OPERATION, _other_mode_too_long(route, sequence))
    if state == OPERATION_ENABLED and (homing or whole):
        following = _HOMING if homing else _SETTLING
        return _step(Sequence(following, 0, sequence.mode), ENABLE_OPERATION, _NONE)
    controlword = CONTROLWORD[ENABLED, state]
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
    if STATE_OF[statusword & 0x7F] != OPERATION_ENABLED:
        return _step(release(sequence), DISABLE_VOLTAGE, _LEFT_HOMING)
    if cycles < HOMING_START_CYCLES:
        return _step(_waiting(sequence), ENABLE_OPERATION, _NONE)
    problem, progress = _NONE, HOMING_PROGRESS[(statusword & HOMING_MASK) >> 10]
    if route.homed_by_bit_12 and progress == ATTAINED_MOVING:
        progress = COMPLETED
    if cycles - age >= 2 * HOMING_START_CYCLES:
        if progress == COMPLETED and whole:
            if route.mode_switch_disabled:
                return Step(Sequence(_TAKING_OVER, 0, route.mode), QUICK_STOP, _NONE, _HOMING_MODE)
            return _step(Sequence(_SETTLING, 0, route.mode), ENABLE_OPERATION, _NONE)
        if progress in (ERROR, ERROR_MOVING):
            problem = _HOMING_ERROR
    if cycles * route.period_s > HOMING_LIMIT_S and problem == _NONE:
        problem = _HOMING_TOO_LONG
    return _step(_waiting(sequence), ENABLE_OPERATION | START_HOMING, problem)


@kernel
def _servo(route: Route, sequence: Sequence, state: int, mode_shown: int) -> Step:
    if state != OPERATION_ENABLED:
        return _step(release(sequence), DISABLE_VOLTAGE, _LEFT)
    if sequence.cycles + 1 < SETTLING_CYCLES:
        return _step(_waiting(sequence), ENABLE_OPERATION, _NONE)
    if _other_mode(sequence, mode_shown):
        return _step(_waiting(sequence), ENABLE_OPERATION, _other_mode_too_long(route, sequence))
    return _step(Sequence(_SERVO, 0, sequence.mode), ENABLE_OPERATION, _NONE)


@kernel
def _quick_stop(route: Route, sequence: Sequence, state: int) -> Step:
    braking = state in (OPERATION_ENABLED, QUICK_STOP_ACTIVE)
    if braking and sequence.cycles * route.period_s <= QUICK_STOP_LIMIT_S:
        return _step(_waiting(sequence), CONTROLWORD[QUICK_STOPPED, state], _NONE)
    return _step(release(sequence), CONTROLWORD[DISABLED, state], _NONE)


@kernel
def _disable(route: Route, sequence: Sequence, state: int) -> Step:
    powered = POWERED[state] or state == SWITCHED_ON
    in_time = sequence.phase == _DISABLING and sequence.cycles * route.period_s <= DISABLE_LIMIT_S
    following = _waiting(sequence) if powered and in_time else Sequence(_OFF, 0, sequence.mode)
    return _step(following, CONTROLWORD[DISABLED, state], _NONE)


@kernel
def _waiting(sequence: Sequence) -> Sequence:
    return Sequence(sequence.phase, sequence.cycles + 1, sequence.mode)
