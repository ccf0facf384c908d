"""Power drive state machine of CiA 402 as one table: (state, cause) -> (transition number, next state).

A cause is a command of the controlword or an event in the drive. `docs/drive_states.md` is drawn from the
table. Transition 0 is power-up.
"""

from enum import Enum, IntEnum
from typing import NamedTuple


class State(IntEnum):
    """States, by the bits of the statusword that show them (mask 6Fh; bit 5, quick stop, is active low)."""

    NOT_READY_TO_SWITCH_ON = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY_TO_SWITCH_ON = 0x21
    SWITCHED_ON = 0x23
    OPERATION_ENABLED = 0x27
    QUICK_STOP_ACTIVE = 0x07
    FAULT_REACTION_ACTIVE = 0x0F
    FAULT = 0x08


class Command(Enum):
    """Commands, by (mask, value) on the controlword."""

    SHUTDOWN = (0x87, 0x06)
    SWITCH_ON = (0x8F, 0x07)  # in operation enabled this is "disable operation"
    ENABLE_OPERATION = (0x8F, 0x0F)
    QUICK_STOP = (0x86, 0x02)
    DISABLE_VOLTAGE = (0x82, 0x00)
    FAULT_RESET = (0x80, 0x80)  # rising edge of bit 7


class Event(Enum):
    """Events in the drive that no command causes."""

    SELF_TEST_PASSED = "self-test passed"
    QUICK_STOP_ENDED = "quick stop ended"  # with 605Ah of 0 to 4
    FAULT = "fault"
    FAULT_REACTION_ENDED = "fault reaction ended"


class Transition(NamedTuple):
    """Number in the state diagram of CiA 402, and the next state."""

    number: int
    target: State


TRANSITIONS: dict[tuple[State, Command | Event], Transition] = {
    (State.NOT_READY_TO_SWITCH_ON, Event.SELF_TEST_PASSED): Transition(1, State.SWITCH_ON_DISABLED),
    (State.SWITCH_ON_DISABLED, Command.SHUTDOWN): Transition(2, State.READY_TO_SWITCH_ON),
    (State.READY_TO_SWITCH_ON, Command.SWITCH_ON): Transition(3, State.SWITCHED_ON),
    (State.READY_TO_SWITCH_ON, Command.ENABLE_OPERATION): Transition(
        3, State.SWITCHED_ON
    ),  # then 4 by itself
    (State.READY_TO_SWITCH_ON, Command.DISABLE_VOLTAGE): Transition(7, State.SWITCH_ON_DISABLED),
    (State.READY_TO_SWITCH_ON, Command.QUICK_STOP): Transition(7, State.SWITCH_ON_DISABLED),
    (State.SWITCHED_ON, Command.ENABLE_OPERATION): Transition(4, State.OPERATION_ENABLED),
    (State.SWITCHED_ON, Command.SHUTDOWN): Transition(6, State.READY_TO_SWITCH_ON),
    (State.SWITCHED_ON, Command.DISABLE_VOLTAGE): Transition(10, State.SWITCH_ON_DISABLED),
    (State.SWITCHED_ON, Command.QUICK_STOP): Transition(10, State.SWITCH_ON_DISABLED),
    (State.OPERATION_ENABLED, Command.SWITCH_ON): Transition(5, State.SWITCHED_ON),
    (State.OPERATION_ENABLED, Command.SHUTDOWN): Transition(8, State.READY_TO_SWITCH_ON),
    (State.OPERATION_ENABLED, Command.DISABLE_VOLTAGE): Transition(9, State.SWITCH_ON_DISABLED),
    (State.OPERATION_ENABLED, Command.QUICK_STOP): Transition(11, State.QUICK_STOP_ACTIVE),
    (State.QUICK_STOP_ACTIVE, Command.DISABLE_VOLTAGE): Transition(12, State.SWITCH_ON_DISABLED),
    (State.QUICK_STOP_ACTIVE, Event.QUICK_STOP_ENDED): Transition(12, State.SWITCH_ON_DISABLED),
    (State.QUICK_STOP_ACTIVE, Command.ENABLE_OPERATION): Transition(16, State.OPERATION_ENABLED),
    (State.NOT_READY_TO_SWITCH_ON, Event.FAULT): Transition(13, State.FAULT_REACTION_ACTIVE),
    (State.SWITCH_ON_DISABLED, Event.FAULT): Transition(13, State.FAULT_REACTION_ACTIVE),
    (State.READY_TO_SWITCH_ON, Event.FAULT): Transition(13, State.FAULT_REACTION_ACTIVE),
    (State.SWITCHED_ON, Event.FAULT): Transition(13, State.FAULT_REACTION_ACTIVE),
    (State.OPERATION_ENABLED, Event.FAULT): Transition(13, State.FAULT_REACTION_ACTIVE),
    (State.QUICK_STOP_ACTIVE, Event.FAULT): Transition(13, State.FAULT_REACTION_ACTIVE),
    (State.FAULT_REACTION_ACTIVE, Event.FAULT_REACTION_ENDED): Transition(14, State.FAULT),
    (State.FAULT, Command.FAULT_RESET): Transition(15, State.SWITCH_ON_DISABLED),
}

POWERED = {State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE}
"""States in which the motor may carry current."""

VOLTAGE_ENABLED = 1 << 4  # the DC link always has its voltage
REMOTE = 1 << 9
INTERNAL_LIMIT = 1 << 11
HALT = 1 << 8


def decode(controlword: int, previous: int) -> Command | None:
    """Return the command of a controlword; `previous`, the one before it, shows the edge of a fault reset."""
    if controlword & 0x80:
        return None if previous & 0x80 else Command.FAULT_RESET
    for command in Command:
        mask, value = command.value
        if controlword & mask == value:
            return command
    return None


def transition(state: State, command: Command | None, quick_stop_stays: bool) -> Transition | None:
    """Return the transition of a command; 16 exists only where quick stop stays (605Ah is 5 to 8)."""
    if command is None:
        return None
    found = TRANSITIONS.get((state, command))
    if found is not None and found.number == 16 and not quick_stop_stays:
        return None
    return found
