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

from kernels.jit import kernel
from servo_ctrl.cyclic.cia402 import (
    DISABLE_VOLTAGE,
    ENABLE_OPERATION,
    FAULT_RESET,
    HOMING_MASK,
    QUICK_STOP,
    SHUTDOWN,
    START_HOMING,
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
)
from servo_ctrl.cyclic.sequence_state import (
    AWAITING_REST,
    DISABLING,
    HOMING,
    HOMING_ERROR,
    HOMING_MODE,
    HOMING_TOO_LONG,
    LEFT,
    LEFT_HOMING,
    MOVES,
    NO_PROBLEM,
    OFF,
    QUICK_STOPPING,
    SERVO,
    SETTLING,
    STAYS,
    STAYS_IN_MODE,
    SWITCHING_ON,
    TAKING_OVER,
    Route,
    Sequence,
    Step,
    release,
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


@kernel
def advance(
    route: Route,
    sequence: Sequence,
    statusword: int,
    complete: bool,
    age: int,
    at_standstill: bool,
    mode_shown: int,
) -> Step:
    """Return the next step, given the drive's statusword of this cycle.

    `complete`: all inputs of the axis have arrived in it; `age`: cycles that the statusword may be old;
    `at_standstill`: whether the axis stands still and may be given power; `mode_shown`: the mode that the
    drive reports.
    """
    state = STATE_OF[statusword & 0x7F]
    phase = sequence.phase
    if phase == SERVO and state == OPERATION_ENABLED:  # nearly every cycle
        step = _step(sequence, ENABLE_OPERATION, NO_PROBLEM)
    elif phase in (SETTLING, SERVO):
        step = _servo(route, sequence, state, mode_shown)
    elif phase in (TAKING_OVER, AWAITING_REST):
        step = _take_over(route, sequence, state, complete, at_standstill)
    elif phase == SWITCHING_ON:
        step = _switch_on(route, sequence, state, complete, mode_shown)
    elif phase == HOMING:
        step = _home(route, sequence, statusword, complete, age)
    elif phase == QUICK_STOPPING:
        step = _quick_stop(route, sequence, state)
    elif phase in (DISABLING, OFF):
        step = _disable(route, sequence, state)
    else:
        step = _step(sequence, QUICK_STOP, NO_PROBLEM)
    return step


@kernel
def _step(sequence: Sequence, controlword: int, problem: int) -> Step:
    """Go on in the mode of the sequence."""
    return Step(sequence, controlword, problem, sequence.mode)


@kernel
def _take_over(route: Route, sequence: Sequence, state: int, complete: bool, at_standstill: bool) -> Step:
    """Wait until a drive that is found with power has stopped and is switched off, and its axis stands still.

    Once power is on its way it is not called back: an answer may be some cycles old.
    """
    waited_s = sequence.cycles * route.period_s
    if POWERED[state] or state == NOT_READY:
        goal = QUICK_STOPPED if waited_s <= QUICK_STOP_LIMIT_S else DISABLED
        mode = HOMING_MODE if route.homing and route.mode_switch_disabled else sequence.mode
        return Step(_waiting(sequence), CONTROLWORD[goal, state], _too_long(waited_s), mode)
    if not at_standstill:
        problem = MOVES if waited_s > SWITCH_ON_LIMIT_S else NO_PROBLEM
        return _step(Sequence(AWAITING_REST, sequence.cycles + 1, sequence.mode), SHUTDOWN, problem)
    return _switch_on(route, Sequence(SWITCHING_ON, 0, sequence.mode), state, complete, UNKNOWN_MODE)


@kernel
def _switch_on(route: Route, sequence: Sequence, state: int, complete: bool, mode_shown: int) -> Step:
    cycles = sequence.cycles
    homing = sequence.mode == HOMING_MODE
    if state == OPERATION_ENABLED and _other_mode(sequence, mode_shown):
        return _step(_waiting(sequence), ENABLE_OPERATION, _other_mode_too_long(route, sequence))
    if state == OPERATION_ENABLED and (homing or complete):
        following = HOMING if homing else SETTLING
        return _step(Sequence(following, 0, sequence.mode), ENABLE_OPERATION, NO_PROBLEM)
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
    return STAYS_IN_MODE if sequence.cycles * route.period_s > SWITCH_ON_LIMIT_S else NO_PROBLEM


@kernel
def _too_long(waited_s: float) -> int:
    return STAYS if waited_s > SWITCH_ON_LIMIT_S else NO_PROBLEM


@kernel
def _home(route: Route, sequence: Sequence, statusword: int, complete: bool, age: int) -> Step:
    cycles = sequence.cycles
    if STATE_OF[statusword & 0x7F] != OPERATION_ENABLED:
        return _step(release(sequence), DISABLE_VOLTAGE, LEFT_HOMING)
    if cycles < HOMING_START_CYCLES:
        return _step(_waiting(sequence), ENABLE_OPERATION, NO_PROBLEM)
    problem, progress = NO_PROBLEM, HOMING_PROGRESS[(statusword & HOMING_MASK) >> 10]
    if route.homed_by_bit_12 and progress == ATTAINED_MOVING:
        progress = COMPLETED
    if cycles - age >= 2 * HOMING_START_CYCLES:
        if progress == COMPLETED and complete:
            if route.mode_switch_disabled:
                return Step(Sequence(TAKING_OVER, 0, route.mode), QUICK_STOP, NO_PROBLEM, HOMING_MODE)
            return _step(Sequence(SETTLING, 0, route.mode), ENABLE_OPERATION, NO_PROBLEM)
        if progress in (ERROR, ERROR_MOVING):
            problem = HOMING_ERROR
    if cycles * route.period_s > HOMING_LIMIT_S and problem == NO_PROBLEM:
        problem = HOMING_TOO_LONG
    return _step(_waiting(sequence), ENABLE_OPERATION | START_HOMING, problem)


@kernel
def _servo(route: Route, sequence: Sequence, state: int, mode_shown: int) -> Step:
    if state != OPERATION_ENABLED:
        return _step(release(sequence), DISABLE_VOLTAGE, LEFT)
    if sequence.cycles + 1 < SETTLING_CYCLES:
        return _step(_waiting(sequence), ENABLE_OPERATION, NO_PROBLEM)
    if _other_mode(sequence, mode_shown):
        return _step(_waiting(sequence), ENABLE_OPERATION, _other_mode_too_long(route, sequence))
    return _step(Sequence(SERVO, 0, sequence.mode), ENABLE_OPERATION, NO_PROBLEM)


@kernel
def _quick_stop(route: Route, sequence: Sequence, state: int) -> Step:
    braking = state in (OPERATION_ENABLED, QUICK_STOP_ACTIVE)
    if braking and sequence.cycles * route.period_s <= QUICK_STOP_LIMIT_S:
        return _step(_waiting(sequence), CONTROLWORD[QUICK_STOPPED, state], NO_PROBLEM)
    return _step(release(sequence), CONTROLWORD[DISABLED, state], NO_PROBLEM)


@kernel
def _disable(route: Route, sequence: Sequence, state: int) -> Step:
    powered = POWERED[state] or state == SWITCHED_ON
    in_time = sequence.phase == DISABLING and sequence.cycles * route.period_s <= DISABLE_LIMIT_S
    following = _waiting(sequence) if powered and in_time else Sequence(OFF, 0, sequence.mode)
    return _step(following, CONTROLWORD[DISABLED, state], NO_PROBLEM)


@kernel
def _waiting(sequence: Sequence) -> Sequence:
    return Sequence(sequence.phase, sequence.cycles + 1, sequence.mode)
