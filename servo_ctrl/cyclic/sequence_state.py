"""The state of a drive's sequence, what of it is fixed, and where a command takes it. See `sequence`."""

from typing import NamedTuple

from kernels.jit import kernel
from servo_ctrl.cyclic.cia402 import Mode
from servo_ctrl.cyclic.drive_phases import Phase, Problem


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


# Members of `Phase` and `Problem` as ints: an enumeration would compile to another type.
(TAKING_OVER, AWAITING_REST, SWITCHING_ON, HOMING, SETTLING, SERVO, QUICK_STOPPING, DISABLING, OFF, LOST) = (
    int(phase) for phase in Phase
)
NO_PROBLEM, STAYS, MOVES, LEFT, LEFT_HOMING, HOMING_ERROR, HOMING_TOO_LONG, STAYS_IN_MODE = (
    int(problem) for problem in Problem
)
HOMING_MODE = int(Mode.HOMING)


def begin(route: Route, *, homed: bool = False) -> Sequence:
    """Begin the sequence of a drive in any state; one that is homed already is not homed again."""
    return Sequence(TAKING_OVER, 0, HOMING_MODE if route.homing and not homed else route.mode)


def home() -> Sequence:
    """Go from servo to homing, and back."""
    return Sequence(HOMING, 0, HOMING_MODE)


def brake(sequence: Sequence) -> Sequence:
    """Go from any phase to the drive's own quick stop, in the mode it is in."""
    return Sequence(QUICK_STOPPING, 0, sequence.mode)


@kernel
def release(sequence: Sequence) -> Sequence:
    """Go from any phase to power off."""
    return Sequence(DISABLING, 0, sequence.mode)


def lose(sequence: Sequence) -> Sequence:
    """Give a drive up that does not respond, from any phase; as it may receive our frames, they say brake."""
    return Sequence(LOST, 0, sequence.mode)
