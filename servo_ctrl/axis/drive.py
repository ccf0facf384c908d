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
"""

from collections.abc import Callable
from enum import Enum
from typing import NamedTuple

from servo_ctrl.canopen.cia402 import (
    CONTROLWORD_TOWARDS,
    DISABLE_VOLTAGE,
    ENABLE_OPERATION,
    FAULT_RESET,
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


class Phase(Enum):
    """Where a drive is in its sequence."""

    TAKING_OVER = "taking over"
    AWAITING_REST = "waiting for rest"
    SWITCHING_ON = "switching on"
    HOMING = "homing"
    SETTLING = "settling"
    SERVO = "servo"
    QUICK_STOPPING = "quick stopping"
    DISABLING = "disabling"
    OFF = "off"
    LOST = "lost"


class Route(NamedTuple):
    """The fixed part of a drive's sequence: its mode, whether it is homed, and the period in seconds."""

    mode: Mode
    homing: bool
    period_s: float
    mode_switch_disabled: bool = False
    """It takes another mode only without power."""
    homed_by_bit_12: bool = False
    """Statusword bit 10 does not tell the end of homing."""


class Sequence(NamedTuple):
    """Where the sequence is, for how many cycles, and the mode of operation that goes with it."""

    phase: Phase
    cycles: int
    mode: Mode


class Step(NamedTuple):
    """The result of one cycle of the sequence."""

    sequence: Sequence
    controlword: int
    problem: str = ""
    """Why the drive cannot go on; the fault policy decides."""
    sent_mode: Mode | None = None
    """Mode of operation that goes out, where it is not yet the sequence's."""


POWERED = frozenset(
    {DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE, DriveState.FAULT_REACTION_ACTIVE}
)
"""States in which the motor has current."""
UNDER_CONTROL = frozenset({Phase.SETTLING, Phase.SERVO})
"""Phases in which our loop leads the axis."""
HOMED = frozenset({Phase.SETTLING, Phase.TAKING_OVER})
"""Where homing that has come to its end leads to."""


def begin(route: Route, *, homed: bool = False) -> Sequence:
    """Begin the sequence of a drive in any state; one that is homed already is not homed again."""
    return Sequence(Phase.TAKING_OVER, 0, Mode.HOMING if route.homing and not homed else route.mode)


def home() -> Sequence:
    """Go from servo to homing, and back."""
    return Sequence(Phase.HOMING, 0, Mode.HOMING)


def brake(sequence: Sequence) -> Sequence:
    """Go from any phase to the drive's own quick stop, in the mode it is in."""
    return Sequence(Phase.QUICK_STOPPING, 0, sequence.mode)


def release(sequence: Sequence) -> Sequence:
    """Go from any phase to power off."""
    return Sequence(Phase.DISABLING, 0, sequence.mode)


def lose(sequence: Sequence) -> Sequence:
    """Give a drive up that does not respond, from any phase; as it may receive our frames, they say brake."""
    return Sequence(Phase.LOST, 0, sequence.mode)


def advance(
    route: Route,
    sequence: Sequence,
    statusword: int,
    *,
    whole: bool = True,
    age: int = 0,
    rests: Callable[[], bool] = lambda: True,
    mode_shown: int | None = None,
) -> Step:
    """Return the next step, given the drive's statusword of this cycle.

    `whole`: all inputs of the axis have come in it; `age`: cycles that the statusword may be old;
    `rests()`: whether the axis stands still, asked where it has no power yet; `mode_shown`: the mode that
    the drive says it is in (6061h), None where it does not say.
    """
    state = drive_state(statusword)
    match sequence.phase:
        case Phase.SERVO if state is DriveState.OPERATION_ENABLED:  # nearly every cycle
            step = Step(sequence, ENABLE_OPERATION)
        case Phase.TAKING_OVER | Phase.AWAITING_REST:
            step = _take_over(route, sequence, state, whole=whole, rests=rests)
        case Phase.SWITCHING_ON:
            step = _switch_on(route, sequence, state, whole=whole, mode_shown=mode_shown)
        case Phase.HOMING:
            step = _home(route, sequence, statusword, state, whole=whole, age=age)
        case Phase.SETTLING | Phase.SERVO:
            step = _servo(route, sequence, state, mode_shown)
        case Phase.QUICK_STOPPING:
            step = _quick_stop(route, sequence, state)
        case Phase.DISABLING | Phase.OFF:
            step = _disable(route, sequence, state)
        case Phase.LOST:
            step = Step(sequence, QUICK_STOP)
    return step


def _take_over(
    route: Route, sequence: Sequence, state: DriveState, *, whole: bool, rests: Callable[[], bool]
) -> Step:
    """Wait until a drive that is found with power has stopped and given it up, and until its axis rests.

    Once power is on its way it is not called back: an answer may be some cycles old.
    """
    waited_s = sequence.cycles * route.period_s
    if state in POWERED or state is DriveState.NOT_READY_TO_SWITCH_ON:
        goal = Goal.QUICK_STOPPED if waited_s <= QUICK_STOP_LIMIT_S else Goal.DISABLED
        kept = Mode.HOMING if route.homing and route.mode_switch_disabled else None
        return Step(_waiting(sequence), CONTROLWORD_TOWARDS[goal][state], _too_long(waited_s, state), kept)
    if not rests():
        problem = "is not switched on: its axis moves" if waited_s > SWITCH_ON_LIMIT_S else ""
        return Step(_waiting(sequence)._replace(phase=Phase.AWAITING_REST), SHUTDOWN, problem)
    return _switch_on(route, Sequence(Phase.SWITCHING_ON, 0, sequence.mode), state, whole=whole)


def _switch_on(
    route: Route, sequence: Sequence, state: DriveState, *, whole: bool, mode_shown: int | None = None
) -> Step:
    cycles = sequence.cycles
    homing = sequence.mode is Mode.HOMING
    if state is DriveState.OPERATION_ENABLED and mode_shown not in {None, sequence.mode}:
        too_long = cycles * route.period_s > SWITCH_ON_LIMIT_S
        problem = f"stays in mode {mode_shown} instead of {sequence.mode.value}" if too_long else ""
        return Step(_waiting(sequence), ENABLE_OPERATION, problem)
    if state is DriveState.OPERATION_ENABLED and (homing or whole):
        following = Phase.HOMING if homing else Phase.SETTLING
        return Step(Sequence(following, 0, sequence.mode), ENABLE_OPERATION)
    controlword = CONTROLWORD_TOWARDS[Goal.ENABLED][state]
    if controlword == FAULT_RESET and cycles // FAULT_RESET_CYCLES % 2 == 0:
        controlword = DISABLE_VOLTAGE  # low first: the reset is the edge
    return Step(_waiting(sequence), controlword, _too_long(cycles * route.period_s, state))


def _too_long(waited_s: float, state: DriveState) -> str:
    return f"stays in {state.value}" if waited_s > SWITCH_ON_LIMIT_S else ""


def _home(
    route: Route, sequence: Sequence, statusword: int, state: DriveState, *, whole: bool, age: int
) -> Step:
    following, cycles = _waiting(sequence), sequence.cycles
    if state is not DriveState.OPERATION_ENABLED:
        return Step(release(sequence), DISABLE_VOLTAGE, f"is in {state.value} during homing")
    if cycles < HOMING_START_CYCLES:
        return Step(following, ENABLE_OPERATION)
    controlword = ENABLE_OPERATION | START_HOMING
    problem, progress = "", homing_status(statusword)
    if route.homed_by_bit_12 and progress is Homing.ATTAINED_MOVING:
        progress = Homing.COMPLETED
    if cycles - age >= 2 * HOMING_START_CYCLES:
        if progress is Homing.COMPLETED and whole:
            if route.mode_switch_disabled:
                return Step(Sequence(Phase.TAKING_OVER, 0, route.mode), QUICK_STOP, "", Mode.HOMING)
            return Step(Sequence(Phase.SETTLING, 0, route.mode), ENABLE_OPERATION)
        if progress in {Homing.ERROR, Homing.ERROR_MOVING}:
            problem = "reports a homing error"
    if cycles * route.period_s > HOMING_LIMIT_S and not problem:
        problem = f"did not finish homing in {HOMING_LIMIT_S:g} s"
    return Step(following, controlword, problem)


def _servo(route: Route, sequence: Sequence, state: DriveState, mode_shown: int | None) -> Step:
    if state is not DriveState.OPERATION_ENABLED:
        return Step(release(sequence), DISABLE_VOLTAGE, f"is in {state.value}")
    settled = sequence.cycles + 1 >= SETTLING_CYCLES
    if settled and mode_shown not in {None, sequence.mode}:
        too_long = sequence.cycles * route.period_s > SWITCH_ON_LIMIT_S
        problem = f"stays in mode {mode_shown} instead of {sequence.mode.value}" if too_long else ""
        return Step(_waiting(sequence), ENABLE_OPERATION, problem)
    following = Sequence(Phase.SERVO, 0, sequence.mode) if settled else _waiting(sequence)
    return Step(following, ENABLE_OPERATION)


def _quick_stop(route: Route, sequence: Sequence, state: DriveState) -> Step:
    braking = state in {DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE}
    if braking and sequence.cycles * route.period_s <= QUICK_STOP_LIMIT_S:
        return Step(_waiting(sequence), CONTROLWORD_TOWARDS[Goal.QUICK_STOPPED][state])
    return Step(release(sequence), CONTROLWORD_TOWARDS[Goal.DISABLED][state])


def _disable(route: Route, sequence: Sequence, state: DriveState) -> Step:
    powered = state in POWERED or state is DriveState.SWITCHED_ON
    in_time = sequence.phase is Phase.DISABLING and sequence.cycles * route.period_s <= DISABLE_LIMIT_S
    following = _waiting(sequence) if powered and in_time else Sequence(Phase.OFF, 0, sequence.mode)
    return Step(following, CONTROLWORD_TOWARDS[Goal.DISABLED][state])


def _waiting(sequence: Sequence) -> Sequence:
    return Sequence(sequence.phase, sequence.cycles + 1, sequence.mode)
