"""The master's CiA 402 table walks a device, written from the standard's transitions, wherever it wants."""

import pytest

from servo_ctrl.cyclic.cia402 import CONTROLWORD_TOWARDS, DriveState, Goal, Homing, drive_state, homing_status

S = DriveState
BITS = {  # statusword bits 6, 5, 3, 2, 1, 0 of each state, CiA 402 table of the statusword
    S.NOT_READY_TO_SWITCH_ON: "0-0000",
    S.SWITCH_ON_DISABLED: "1-0000",
    S.READY_TO_SWITCH_ON: "010001",
    S.SWITCHED_ON: "010011",
    S.OPERATION_ENABLED: "010111",
    S.QUICK_STOP_ACTIVE: "000111",
    S.FAULT_REACTION_ACTIVE: "0-1111",
    S.FAULT: "0-1000",
}


def words(pattern: str) -> list[int]:
    """All statuswords' low bytes that a pattern allows, bit 4 and 7 free."""
    found = []
    for low in range(256):
        bits = "".join(str(low >> n & 1) for n in (6, 5, 3, 2, 1, 0))
        if all(want in {"-", have} for want, have in zip(pattern, bits, strict=True)):
            found.append(low)
    return found


@pytest.mark.parametrize("state", DriveState)
def test_every_statusword_of_a_state_is_read_as_that_state(state: DriveState) -> None:
    for low in words(BITS[state]):
        for high in (0x00, 0x16, 0xFF):
            assert drive_state(high << 8 | low) is state


def device(state: DriveState, previous: int, controlword: int) -> DriveState:
    """One step of the power stage: the transitions of CiA 402, figure 'power drive state machine'."""
    command = controlword & 0x8F
    shutdown, disable_voltage = command & 0x87 == 0x06, command & 0x82 == 0x00
    quick_stop = command & 0x86 == 0x02
    switch_on, enable = command & 0x8F == 0x07, command & 0x8F == 0x0F
    if state is S.FAULT:
        return S.SWITCH_ON_DISABLED if controlword & 0x80 and not previous & 0x80 else S.FAULT
    after: dict[DriveState, list[tuple[bool, DriveState]]] = {
        S.NOT_READY_TO_SWITCH_ON: [(True, S.SWITCH_ON_DISABLED)],
        S.SWITCH_ON_DISABLED: [(shutdown, S.READY_TO_SWITCH_ON)],
        S.READY_TO_SWITCH_ON: [
            (switch_on, S.SWITCHED_ON),
            (disable_voltage or quick_stop, S.SWITCH_ON_DISABLED),
        ],
        S.SWITCHED_ON: [
            (enable, S.OPERATION_ENABLED),
            (shutdown, S.READY_TO_SWITCH_ON),
            (disable_voltage or quick_stop, S.SWITCH_ON_DISABLED),
        ],
        S.OPERATION_ENABLED: [
            (disable_voltage, S.SWITCH_ON_DISABLED),
            (quick_stop, S.QUICK_STOP_ACTIVE),
            (shutdown, S.READY_TO_SWITCH_ON),
            (switch_on, S.SWITCHED_ON),
        ],
        S.QUICK_STOP_ACTIVE: [(disable_voltage, S.SWITCH_ON_DISABLED)],
        S.FAULT_REACTION_ACTIVE: [(True, S.FAULT)],
    }
    return next((target for taken, target in after[state] if taken), state)


@pytest.mark.parametrize("start", DriveState)
@pytest.mark.parametrize(
    ("goal", "ends"),
    [
        (Goal.ENABLED, {S.OPERATION_ENABLED}),
        (Goal.DISABLED, {S.SWITCH_ON_DISABLED, S.FAULT}),
        (Goal.QUICK_STOPPED, {S.QUICK_STOP_ACTIVE, S.SWITCH_ON_DISABLED, S.FAULT}),
    ],
)
def test_table_leads_from_every_state_to_the_goal(
    start: DriveState, goal: Goal, ends: set[DriveState]
) -> None:
    state, previous = start, 0
    for _ in range(10):
        controlword = CONTROLWORD_TOWARDS[goal][state]
        state, previous = device(state, previous, controlword), controlword
    assert state in ends


@pytest.mark.parametrize("goal", Goal)
def test_every_goal_has_an_answer_to_every_state(goal: Goal) -> None:
    assert set(CONTROLWORD_TOWARDS[goal]) == set(DriveState)


@pytest.mark.parametrize(
    ("statusword", "expected"),
    [
        (0x0227, Homing.IN_PROGRESS),
        (0x0627, Homing.INTERRUPTED),
        (0x1227, Homing.ATTAINED_MOVING),
        (0x1627, Homing.COMPLETED),
        (0x2227, Homing.ERROR_MOVING),
        (0x2627, Homing.ERROR),
        (0x3627, Homing.ERROR),
    ],
)
def test_homing_bits_are_those_under_mask_3400(statusword: int, expected: Homing) -> None:
    assert homing_status(statusword) is expected
