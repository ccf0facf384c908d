"""The numbers of CiA 402 that the master uses, typed once more from the standard."""

import pytest

from servo_ctrl.cyclic.cia402 import (
    CONTROLWORD_TOWARDS,
    MODE_OF_NAME,
    START_HOMING,
    SUPPORTED_BIT,
    DriveState,
    Goal,
    Mode,
    drive_state,
)

PATTERNS = {  # bits 6 to 0 of the statusword
    DriveState.NOT_READY_TO_SWITCH_ON: "0xx0000",
    DriveState.SWITCH_ON_DISABLED: "1xx0000",
    DriveState.READY_TO_SWITCH_ON: "01x0001",
    DriveState.SWITCHED_ON: "01x0011",
    DriveState.OPERATION_ENABLED: "01x0111",
    DriveState.QUICK_STOP_ACTIVE: "00x0111",
    DriveState.FAULT_REACTION_ACTIVE: "0xx1111",
    DriveState.FAULT: "0xx1000",
}
COLUMNS = tuple(PATTERNS)
WORDS = {  # controlwords in the order of the states above
    Goal.ENABLED: (0x00, 0x06, 0x07, 0x0F, 0x0F, 0x00, 0x00, 0x80),
    Goal.DISABLED: (0x00,) * 8,
    Goal.QUICK_STOPPED: (0x00, 0x00, 0x00, 0x00, 0x02, 0x02, 0x00, 0x00),
}


def test_every_statusword_is_one_state_or_not_ready_to_switch_on() -> None:
    for word in range(0x80):
        bits = f"{word:07b}"
        matching = [
            state
            for state, pattern in PATTERNS.items()
            if all(want in {"x", bit} for want, bit in zip(pattern, bits, strict=True))
        ]
        assert len(matching) <= 1
        wanted = matching[0] if matching else DriveState.NOT_READY_TO_SWITCH_ON
        assert drive_state(word) is drive_state(0xFF80 | word) is wanted, f"{word:02X}h"


@pytest.mark.parametrize("goal", Goal)
def test_controlword_of_every_state(goal: Goal) -> None:
    assert CONTROLWORD_TOWARDS[goal] == dict(zip(COLUMNS, WORDS[goal], strict=True))


def test_modes_and_the_bits_that_announce_them() -> None:
    assert [(mode.name, mode.value) for mode in Mode] == [
        ("HOMING", 6),
        ("CYCLIC_SYNC_POSITION", 8),
        ("CYCLIC_SYNC_VELOCITY", 9),
        ("CYCLIC_SYNC_TORQUE", 10),
    ]
    assert {name: mode.value for name, mode in MODE_OF_NAME.items()} == {"csp": 8, "csv": 9, "cst": 10}
    # 6502h announces mode n by bit n - 1
    assert {mode: mode.value - 1 for mode in Mode} == SUPPORTED_BIT


def test_homing_begins_by_bit_4() -> None:
    assert START_HOMING == 1 << 4
