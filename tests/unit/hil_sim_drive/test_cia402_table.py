"""The drive's table by itself, against one typed from CiA 402-2 (over the bus: `test_state_machine.py`)."""

import pytest

from hil_sim.drive.cia402_device import (
    HALT,
    INTERNAL_LIMIT,
    POWERED,
    REMOTE,
    TRANSITIONS,
    VOLTAGE_ENABLED,
    Command,
    Event,
    State,
    decode,
    transition,
)

NRSO, SOD, RTSO, SO, OE, QSA, FRA, FAULT = (
    State.NOT_READY_TO_SWITCH_ON,
    State.SWITCH_ON_DISABLED,
    State.READY_TO_SWITCH_ON,
    State.SWITCHED_ON,
    State.OPERATION_ENABLED,
    State.QUICK_STOP_ACTIVE,
    State.FAULT_REACTION_ACTIVE,
    State.FAULT,
)
STATUS = {  # bits 6 to 0 of the statusword, as the standard prints them; bit 4 is not of the state
    NRSO: "00x0000",
    SOD: "10x0000",
    RTSO: "01x0001",
    SO: "01x0011",
    OE: "01x0111",
    QSA: "00x0111",
    FRA: "00x1111",
    FAULT: "00x1000",
}
COMMANDS = {  # bits 7, 3, 2, 1, 0 of the controlword, as the standard prints them
    Command.SHUTDOWN: "0x110",
    Command.SWITCH_ON: "00111",
    Command.ENABLE_OPERATION: "01111",
    Command.QUICK_STOP: "0x01x",
    Command.DISABLE_VOLTAGE: "0xx0x",
}
FIGURE = [  # the arrows of the figure: number, from, to, what causes it
    (1, NRSO, SOD, Event.SELF_TEST_PASSED),
    (2, SOD, RTSO, Command.SHUTDOWN),
    (3, RTSO, SO, Command.SWITCH_ON),
    (3, RTSO, SO, Command.ENABLE_OPERATION),
    (4, SO, OE, Command.ENABLE_OPERATION),
    (5, OE, SO, Command.SWITCH_ON),
    (6, SO, RTSO, Command.SHUTDOWN),
    (7, RTSO, SOD, Command.QUICK_STOP),
    (7, RTSO, SOD, Command.DISABLE_VOLTAGE),
    (8, OE, RTSO, Command.SHUTDOWN),
    (9, OE, SOD, Command.DISABLE_VOLTAGE),
    (10, SO, SOD, Command.QUICK_STOP),
    (10, SO, SOD, Command.DISABLE_VOLTAGE),
    (11, OE, QSA, Command.QUICK_STOP),
    (12, QSA, SOD, Command.DISABLE_VOLTAGE),
    (12, QSA, SOD, Event.QUICK_STOP_ENDED),
    *((13, state, FRA, Event.FAULT) for state in (NRSO, SOD, RTSO, SO, OE, QSA)),
    (14, FRA, FAULT, Event.FAULT_REACTION_ENDED),
    (15, FAULT, SOD, Command.FAULT_RESET),
    (16, QSA, OE, Command.ENABLE_OPERATION),
]
ARROWS = {(start, cause): (number, end) for number, start, end, cause in FIGURE}


def matches(word: int, pattern: str, bits: tuple[int, ...]) -> bool:
    return all(want in {"x", str(word >> bit & 1)} for bit, want in zip(bits, pattern, strict=True))


def test_states_have_the_bits_that_the_statusword_shows() -> None:
    for state in State:
        assert matches(state, STATUS[state].replace("x", "0"), (6, 5, 4, 3, 2, 1, 0))
        assert state < 0x80
    assert len(State.__members__) == len(State) == len(STATUS) == 8  # none is another by a second name


@pytest.mark.parametrize("previous", [0x00, 0x0F, 0x7F, 0x80, 0xFFFF])
def test_every_controlword_is_the_command_that_the_standard_names(previous: int) -> None:
    for word in (*range(0x100), 0x0100, 0x010F, 0xFF7F, 0xFFFF):
        if word & 0x80:
            wanted = None if previous & 0x80 else Command.FAULT_RESET
        else:
            (wanted,) = [
                command for command, pattern in COMMANDS.items() if matches(word, pattern, (7, 3, 2, 1, 0))
            ]
        assert decode(word, previous) is wanted, f"{word:04X}h after {previous:04X}h"


def test_transition_table_equals_the_figure_of_cia_402() -> None:
    assert {key: (found.number, found.target) for key, found in TRANSITIONS.items()} == ARROWS


@pytest.mark.parametrize("state", State)
@pytest.mark.parametrize("stays", [False, True])
def test_commands_follow_the_transitions_and_16_needs_a_quick_stop_that_stays(
    state: State, stays: bool
) -> None:
    assert transition(state, None, quick_stop_stays=stays) is None
    for command in Command:
        arrow = ARROWS.get((state, command))
        if arrow == (16, OE) and not stays:
            arrow = None
        found = transition(state, command, quick_stop_stays=stays)
        assert (found and (found.number, found.target)) == arrow


def test_power_is_on_in_states_that_brake_or_operate() -> None:
    assert {OE, QSA, FRA} == POWERED


def test_controlword_and_statusword_have_their_other_bits() -> None:
    assert (VOLTAGE_ENABLED, HALT, REMOTE, INTERNAL_LIMIT) == (0x0010, 0x0100, 0x0200, 0x0800)
