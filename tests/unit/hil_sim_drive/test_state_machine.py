"""The state machine over the bus against a table typed from CiA 402-2 (state machine figure and commands)."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from in_process_nodes import InProcessNodes, SdoDrive, counts

from hil_sim.drive.cia402_device import Command, decode

SOD, RTSO, SO, OE, QSA, FAULT = (
    "switch on disabled",
    "ready",
    "switched on",
    "enabled",
    "quick stop",
    "fault",
)
WAY = {
    SOD: (),
    RTSO: (0x06,),
    SO: (0x06, 0x07),
    OE: (0x06, 0x07, 0x0F),
    QSA: (0x06, 0x07, 0x0F, 0x02),
    FAULT: (),
}
# rows: controlword; columns: state reached from SOD, RTSO, SO, OE, QSA (605Ah = 6), FAULT.
# The word before has bit 7 clear, so 80h and more are fault resets.
EXPECTED = {
    0x00: (SOD, SOD, SOD, SOD, SOD, FAULT),
    0x01: (SOD, SOD, SOD, SOD, SOD, FAULT),
    0x02: (SOD, SOD, SOD, QSA, QSA, FAULT),
    0x03: (SOD, SOD, SOD, QSA, QSA, FAULT),
    0x04: (SOD, SOD, SOD, SOD, SOD, FAULT),
    0x05: (SOD, SOD, SOD, SOD, SOD, FAULT),
    0x06: (RTSO, RTSO, RTSO, RTSO, QSA, FAULT),
    0x07: (SOD, SO, SO, SO, QSA, FAULT),
    0x08: (SOD, SOD, SOD, SOD, SOD, FAULT),
    0x0A: (SOD, SOD, SOD, QSA, QSA, FAULT),
    0x0B: (SOD, SOD, SOD, QSA, QSA, FAULT),
    0x0C: (SOD, SOD, SOD, SOD, SOD, FAULT),
    0x0D: (SOD, SOD, SOD, SOD, SOD, FAULT),
    0x0E: (RTSO, RTSO, RTSO, RTSO, QSA, FAULT),
    0x0F: (SOD, OE, OE, OE, OE, FAULT),
    0x1F: (SOD, OE, OE, OE, OE, FAULT),
    0x80: (SOD, RTSO, SO, OE, QSA, SOD),
    0x86: (SOD, RTSO, SO, OE, QSA, SOD),
    0x8F: (SOD, RTSO, SO, OE, QSA, SOD),
}
CASES = [
    (state, word, row[column])
    for word, row in EXPECTED.items()
    for column, state in enumerate((SOD, RTSO, SO, OE, QSA, FAULT))
]


def drive_in(state: str) -> SdoDrive:
    """A drive in PV at standstill; ramps of 605Bh, 605Ch are off so that transitions are immediate."""
    drive = SdoDrive(InProcessNodes())
    drive.set(0x605A, 6)
    drive.set(0x605C, 0)
    drive.set(0x6060, 3)
    for word in WAY[state]:
        drive.control(word)
    if state == FAULT:
        drive.device.fault(0x8611, 0x20)
    assert drive.state == state
    return drive


@pytest.mark.parametrize(("state", "word", "expected"), CASES)
def test_every_controlword_in_every_state(state: str, word: int, expected: str) -> None:
    drive = drive_in(state)
    drive.control(word)
    assert drive.state == expected
    drive.nodes.sync()
    assert drive.state == expected


@pytest.mark.parametrize("option", range(5))
def test_without_stay_option_transition_16_does_not_exist(option: int) -> None:
    drive = drive_in(QSA)
    drive.set(0x605A, option)
    drive.control(0x0F)
    assert drive.state == QSA


def test_fault_reset_bit_that_stays_set_resets_once() -> None:
    drive = drive_in(FAULT)
    drive.control(0x80)
    assert drive.state == SOD
    drive.device.fault(0x8611, 0x20)
    drive.control(0x81)
    assert drive.state == FAULT
    drive.control(0x01)
    drive.control(0x81)
    assert drive.state == SOD


def test_a_level_command_acts_after_an_automatic_transition() -> None:
    """Shutdown given during the quick stop ramp takes effect once the drive is in switch on disabled."""
    drive = SdoDrive(InProcessNodes())
    drive.node.rpdo.read()
    drive.nodes.operational()
    drive.set(0x60FF, counts(20))
    drive.enable(3)
    drive.nodes.sync(100)
    drive.control(0x02)
    assert drive.state == QSA
    for _ in range(300):
        drive.nodes.put(0x201, b"\x06\x00")
        drive.nodes.sync()
    assert drive.state == RTSO


@pytest.mark.parametrize(("word", "code_index"), [(0x07, 0x605C), (0x06, 0x605B)])
@pytest.mark.parametrize("ramp", [0, 1])
def test_disable_and_shutdown_by_ramp_or_at_once(word: int, code_index: int, ramp: int) -> None:
    drive = SdoDrive(InProcessNodes())
    drive.set(code_index, ramp)
    drive.set(0x60FF, counts(20))
    drive.enable(3)
    drive.nodes.sync(200)
    drive.control(word)
    target = SO if word == 0x07 else RTSO
    assert drive.state == (OE if ramp else target)
    drive.nodes.sync(200)
    assert drive.state == target
    assert drive.true_velocity_mm_s == pytest.approx(0 if ramp else 20, abs=0.3)


def test_enable_during_the_ramp_goes_on_moving() -> None:
    drive = SdoDrive(InProcessNodes())
    drive.set(0x60FF, counts(20))
    drive.enable(3)
    drive.nodes.sync(200)
    drive.control(0x07)
    drive.nodes.sync(3)
    drive.control(0x0F)
    drive.nodes.sync(300)
    assert drive.state == OE
    assert drive.true_velocity_mm_s == pytest.approx(20, abs=0.1)


def test_an_unsupported_mode_by_pdo_is_ignored() -> None:
    drive = SdoDrive(InProcessNodes())
    drive.set(0x6060, 8)
    drive.device.objects.modes_of_operation = 2
    drive.device.process()
    assert drive.get(0x6061) == 8


def test_statusword_has_voltage_and_remote_in_every_state() -> None:
    for state in WAY:
        assert drive_in(state).statusword & 0x0210 == 0x0210


def mask_decode(word: int) -> Command | None:
    """Commands as CiA 402 prints them: bits 7 3 2 1 0 with x for do not care."""
    table = {
        "0x110": Command.SHUTDOWN,
        "00111": Command.SWITCH_ON,
        "01111": Command.ENABLE_OPERATION,
        "0xx0x": Command.DISABLE_VOLTAGE,
        "0x01x": Command.QUICK_STOP,
    }
    bits = "".join(str(word >> position & 1) for position in (7, 3, 2, 1, 0))
    found = [
        command
        for pattern, command in table.items()
        if all(wanted in {"x", bit} for wanted, bit in zip(pattern, bits, strict=True))
    ]
    return found[0] if found else None


def test_every_controlword_decodes_to_the_printed_command() -> None:
    for word in range(0x80):
        assert decode(word, 0) is mask_decode(word), hex(word)


words = st.lists(
    st.tuples(
        st.one_of(st.integers(0, 0xFFFF), st.sampled_from([0x06, 0x07, 0x0F, 0x1F, 0x10F, 0x02, 0x80, 0])),
        st.sampled_from([1, 3, 6, 8, 9, 10]),
    ),
    max_size=25,
)


@given(sequence=words)
@settings(max_examples=40, deadline=None)
def test_random_controlwords_move_the_axis_only_with_operation_enabled(
    sequence: list[tuple[int, int]],
) -> None:
    drive = SdoDrive(InProcessNodes())
    drive.set(0x605A, 6)
    drive.set(0x6098, 34)
    drive.set(0x607A, counts(3))
    drive.set(0x60FF, counts(10))
    drive.set(0x6071, 100)
    for word, mode in sequence:
        drive.set(0x6060, mode)
        drive.control(word)
        before = drive.true_velocity_mm_s
        powered = drive.state in {"enabled", "quick stop", "fault reaction"}
        drive.nodes.sync(2)
        if not powered:
            assert drive.true_velocity_mm_s == before, f"{word:#x} moved the axis in state {drive.state}"
