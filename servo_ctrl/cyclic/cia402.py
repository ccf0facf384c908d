"""CiA 402 as tables: modes, the state in a statusword, and the controlword that the master answers with.

The drive's own state machine is on the other side of the bus; here are only the master's moves. The
documentation's diagram is drawn from `CONTROLWORD_TOWARDS`.
"""

from enum import Enum, IntEnum


class Mode(IntEnum):
    """Modes of operation (6060h)."""

    HOMING = 6
    CYCLIC_SYNC_POSITION = 8
    CYCLIC_SYNC_VELOCITY = 9
    CYCLIC_SYNC_TORQUE = 10


MODE_OF_NAME: dict[str, Mode] = {
    "csp": Mode.CYCLIC_SYNC_POSITION,
    "csv": Mode.CYCLIC_SYNC_VELOCITY,
    "cst": Mode.CYCLIC_SYNC_TORQUE,
}
SUPPORTED_BIT: dict[Mode, int] = {
    Mode.HOMING: 5,
    Mode.CYCLIC_SYNC_POSITION: 7,
    Mode.CYCLIC_SYNC_VELOCITY: 8,
    Mode.CYCLIC_SYNC_TORQUE: 9,
}
"""The bit of 6502h (supported drive modes) that announces a mode."""


class DriveState(Enum):
    """States of the power stage (CiA 402 finite state automaton)."""

    NOT_READY_TO_SWITCH_ON = "not ready to switch on"
    SWITCH_ON_DISABLED = "switch on disabled"
    READY_TO_SWITCH_ON = "ready to switch on"
    SWITCHED_ON = "switched on"
    OPERATION_ENABLED = "operation enabled"
    QUICK_STOP_ACTIVE = "quick stop active"
    FAULT_REACTION_ACTIVE = "fault reaction active"
    FAULT = "fault"


STATUS_PATTERNS: tuple[tuple[int, int, DriveState], ...] = (
    (0x4F, 0x00, DriveState.NOT_READY_TO_SWITCH_ON),
    (0x4F, 0x40, DriveState.SWITCH_ON_DISABLED),
    (0x6F, 0x21, DriveState.READY_TO_SWITCH_ON),
    (0x6F, 0x23, DriveState.SWITCHED_ON),
    (0x6F, 0x27, DriveState.OPERATION_ENABLED),
    (0x6F, 0x07, DriveState.QUICK_STOP_ACTIVE),
    (0x4F, 0x0F, DriveState.FAULT_REACTION_ACTIVE),
    (0x4F, 0x08, DriveState.FAULT),
)
"""(mask, value, state) of statusword 6041h."""


def _state_of_low_byte(low: int) -> DriveState:
    found = (state for mask, value, state in STATUS_PATTERNS if low & mask == value)
    return next(found, DriveState.NOT_READY_TO_SWITCH_ON)  # no pattern: wait, as for a drive that starts


_STATE_OF_LOW_BYTE: tuple[DriveState, ...] = tuple(_state_of_low_byte(low) for low in range(0x80))


def drive_state(statusword: int) -> DriveState:
    """The power stage's state in a statusword (6041h)."""
    return _STATE_OF_LOW_BYTE[statusword & 0x7F]


class Homing(Enum):
    """Statusword bits 10, 12 and 13 in homing mode."""

    IN_PROGRESS = 0x0000
    INTERRUPTED = 0x0400
    ATTAINED_MOVING = 0x1000
    COMPLETED = 0x1400
    ERROR_MOVING = 0x2000
    ERROR = 0x2400


HOMING_MASK = 0x3400
"""Statusword bits 10, 12 and 13."""


def homing_status(statusword: int) -> Homing:
    """Homing progress; a drive that claims attained and error at once has an error."""
    bits = statusword & HOMING_MASK
    return Homing(bits & ~0x1000) if bits & 0x2000 else Homing(bits)


class Goal(Enum):
    """Where the master wants the power stage."""

    ENABLED = "enabled"
    DISABLED = "disabled"
    QUICK_STOPPED = "quick stopped"


# Commands of the controlword (6040h), by the names of CiA 402.
SHUTDOWN = 0x0006
SWITCH_ON = 0x0007
ENABLE_OPERATION = 0x000F
DISABLE_VOLTAGE = 0x0000
QUICK_STOP = 0x0002
FAULT_RESET = 0x0080
START_HOMING = 0x0010
"""Controlword bit 4 in homing mode."""

_TO_ENABLED = {
    DriveState.NOT_READY_TO_SWITCH_ON: DISABLE_VOLTAGE,
    DriveState.SWITCH_ON_DISABLED: SHUTDOWN,
    DriveState.READY_TO_SWITCH_ON: SWITCH_ON,
    DriveState.SWITCHED_ON: ENABLE_OPERATION,
    DriveState.OPERATION_ENABLED: ENABLE_OPERATION,
    DriveState.QUICK_STOP_ACTIVE: DISABLE_VOLTAGE,  # the long way round is the same for every 605Ah
    DriveState.FAULT_REACTION_ACTIVE: DISABLE_VOLTAGE,
    DriveState.FAULT: FAULT_RESET,
}
CONTROLWORD_TOWARDS: dict[Goal, dict[DriveState, int]] = {
    Goal.ENABLED: _TO_ENABLED,
    Goal.DISABLED: dict.fromkeys(DriveState, DISABLE_VOLTAGE),
    Goal.QUICK_STOPPED: {
        **dict.fromkeys(DriveState, DISABLE_VOLTAGE),
        DriveState.OPERATION_ENABLED: QUICK_STOP,
        DriveState.QUICK_STOP_ACTIVE: QUICK_STOP,
    },
}
"""Goal -> present state -> controlword (6040h) of the next move. A fault reset needs a rising edge of bit
7: the table gives the level, and any other state's controlword in between makes the edge."""
