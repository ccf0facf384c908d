"""The phases of a drive's sequence, the problems that end it, and the words for both. See `sequence`."""

from enum import IntEnum

from servo_ctrl.cyclic.cia402 import drive_state

SWITCH_ON_LIMIT_S = 5.0
HOMING_LIMIT_S = 120.0
QUICK_STOP_LIMIT_S = 2.0
DISABLE_LIMIT_S = 0.5
"""Bound the wait in a phase; chosen, as the other numbers here."""


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


UNDER_CONTROL = frozenset({Phase.SETTLING, Phase.SERVO})
"""Phases in which our loop controls the axis."""
UNKNOWN_MODE = 0x100
"""Stands for the mode of a drive that does not report it (6061h has eight bits)."""


def problem_text(problem: int, statusword: int, mode_shown: int = UNKNOWN_MODE, mode: int = 0) -> str:
    """A `Problem` in words, of a drive that reports this statusword and should be in `mode`; "" for none."""
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
