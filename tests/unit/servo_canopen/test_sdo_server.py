"""Scripted dialogues with the controller's SDO server, by CiA 301, section 7.2.4."""

import random

import pytest
from controller_node_bench import ControllerNodeBench, abort
from fake_command_handler import LEARNED, REVERSAL

from servo_ctrl.commands.command import Command, CommandRequest, CommandResult, Refusal
from servo_ctrl.commands.learning_status import LearningState

TOGGLE = 0x05030000
COMMAND = 0x05040001
READ_ONLY = 0x06010002
BLOCK_SIZE = 0x05040002
NO_OBJECT = 0x06020000
TOO_LONG = 0x06070012
TOO_SHORT = 0x06070013
NO_SUBINDEX = 0x06090011
INVALID = 0x06090030
TOO_HIGH = 0x06090031
TOO_LOW = 0x06090032
STORAGE = 0x08000020
DEVICE_STATE = 0x08000022
NO_DATA = 0x08000024
DEVICE_TYPE = "4300100000000000"


@pytest.fixture
def bench() -> ControllerNodeBench:
    return ControllerNodeBench.booted()


def test_start_learning_of_the_second_axis_by_two_writes(bench: ControllerNodeBench) -> None:
    assert bench.ask("2f 0121 00 02000000") == ["6001210000000000"]
    assert bench.ask("2f 0021 00 01000000") == ["6000210000000000"]
    assert bench.handler.requests == [CommandRequest(Command.START_LEARNING, "y")]
    assert bench.ask("40 0021 00 00000000") == ["4f00210001000000"]


def test_without_a_selection_a_command_is_for_all_axes(bench: ControllerNodeBench) -> None:
    bench.ask("2f 0021 00 06000000")
    assert bench.handler.requests == [CommandRequest(Command.DISABLE_COMPENSATION, "")]


def test_switches_of_one_axis(bench: ControllerNodeBench) -> None:
    assert bench.ask("2f 0221 01 00000000") == ["6002210100000000"]
    assert bench.ask("2f 0321 02 01000000") == ["6003210200000000"]
    assert bench.handler.requests == [
        CommandRequest(Command.DISABLE_COMPENSATION, "x"),
        CommandRequest(Command.ENABLE_OBSERVER, "y"),
    ]


def test_required_j_of_3500_nm(bench: ControllerNodeBench) -> None:
    assert bench.ask("23 0421 01 ac0d0000") == ["6004210100000000"]
    assert bench.handler.changes == [("required_m", 3.5e-6)]
    assert bench.ask("40 0421 01 00000000") == ["43042101ac0d0000"]


def test_a_write_without_a_size_uses_the_size_of_the_object(bench: ControllerNodeBench) -> None:
    assert bench.ask("22 0021 00 0a000000") == ["6000210000000000"]
    assert bench.handler.requests == [CommandRequest(Command.START_PROGRAM, "")]


@pytest.mark.parametrize(
    ("request_hex", "address", "code"),
    [
        pytest.param("40 3412 00 00000000", "341200", NO_OBJECT, id="no such object"),
        pytest.param("2f 3412 00 00000000", "341200", NO_OBJECT, id="no such object to write"),
        pytest.param("40 0421 0a 00000000", "04210a", NO_SUBINDEX, id="no such subindex of a record"),
        pytest.param("40 0221 03 00000000", "022103", NO_SUBINDEX, id="axis that the machine has not"),
        pytest.param("2f 0221 03 01000000", "022103", NO_SUBINDEX, id="switch of such an axis"),
        pytest.param("2f 0221 09 01000000", "022109", NO_SUBINDEX, id="ninth axis"),
        pytest.param("40 2321 01 00000000", "232101", NO_OBJECT, id="monitoring of such an axis"),
        pytest.param("2f 1021 01 01000000", "102101", READ_ONLY, id="read-only"),
        pytest.param("23 0010 00 01000000", "001000", READ_ONLY, id="constant"),
        pytest.param("21 0010 00 08000000", "001000", READ_ONLY, id="segmented write of read-only"),
        pytest.param("2b 0021 00 01000000", "002100", TOO_LONG, id="two bytes for one"),
        pytest.param("2b 0421 01 a00f0000", "042101", TOO_SHORT, id="two bytes for four"),
        pytest.param("21 0421 01 05000000", "042101", TOO_LONG, id="five bytes announced for four"),
        pytest.param("21 0421 01 00000000", "042101", TOO_SHORT, id="none announced"),
        pytest.param("2f 0021 00 00000000", "002100", INVALID, id="command 0"),
        pytest.param("2f 0021 00 40000000", "002100", INVALID, id="command 64"),
        pytest.param("2f 0121 00 03000000", "012100", INVALID, id="axis 3 of 2"),
        pytest.param("2f 0121 00 09000000", "012100", TOO_HIGH, id="axis 9"),
        pytest.param("2f 0221 01 02000000", "022101", TOO_HIGH, id="switch to 2"),
        pytest.param("23 0421 01 00000000", "042101", TOO_LOW, id="J of 0"),
        pytest.param("23 0421 01 81969800", "042101", TOO_HIGH, id="J of 10 mm and 1 nm"),
        pytest.param("2f 0018 02 f1000000", "001802", INVALID, id="reserved transmission type 241"),
        pytest.param("2f 0018 02 fd000000", "001802", INVALID, id="transmission by remote frame"),
        pytest.param("23 0018 01 81010040", "001801", INVALID, id="identifier of a drive's PDO"),
        pytest.param("23 001a 01 08000020", "001a01", DEVICE_STATE, id="other mapping while the PDO is on"),
        pytest.param("40 0018 04 00000000", "001804", NO_SUBINDEX, id="reserved entry of the PDO"),
        pytest.param("40 0120 00 00000000", "012000", NO_DATA, id="empty string"),
        pytest.param("a0 0010 00 00000000", "001000", BLOCK_SIZE, id="block of no segments"),
        pytest.param("a0 ff5f 00 7f000000", "ff5f00", NO_OBJECT, id="block of no object"),
        pytest.param("c2 0421 01 05000000", "042101", TOO_LONG, id="block download too long"),
        pytest.param("c2 0010 00 04000000", "001000", READ_ONLY, id="block download of a constant"),
        pytest.param("e0 0000 00 00000000", "000000", COMMAND, id="no such command specifier"),
    ],
)
def test_refused_transfers_abort_with_their_code(
    bench: ControllerNodeBench, request_hex: str, address: str, code: int
) -> None:
    assert bench.ask(request_hex) == abort(address, code)
    assert (bench.handler.requests, bench.handler.changes) == ([], [])


@pytest.mark.parametrize(
    ("refusal", "code"),
    [
        (Refusal.UNKNOWN, INVALID),
        (Refusal.OUT_OF_RANGE, INVALID),
        (Refusal.WRONG_STATE, DEVICE_STATE),
        (Refusal.STORAGE, STORAGE),
    ],
)
def test_a_refused_command_has_an_abort_code_and_its_reason_in_2105(
    bench: ControllerNodeBench, refusal: Refusal, code: int
) -> None:
    bench.handler.verdict = CommandResult(refusal, "the machine moves")
    assert bench.ask("2f 0021 00 01000000") == abort("002100", code)
    assert bench.ask("2f 0321 01 01000000") == abort("032101", code)
    assert bench.ask("2f 0421 02 01000000") == abort("042102", code)
    assert bench.ask("40 0021 00 00000000") == ["4f00210000000000"]  # no command was accepted so far
    assert bench.remote.sdo[0x2105].raw == "the machine moves"


def test_axis_and_command_in_one_transfer(bench: ControllerNodeBench) -> None:
    assert bench.ask("2b 0621 00 01020000") == ["6006210000000000"]
    assert bench.ask("2b 0621 00 06000000") == ["6006210000000000"]
    wanted = [CommandRequest(Command.START_LEARNING, "y"), CommandRequest(Command.DISABLE_COMPENSATION, "")]
    assert bench.handler.requests == wanted
    assert bench.ask("2b 0621 00 01030000") == abort("062100", INVALID)
    assert bench.remote.sdo[0x2105].raw == "there is no axis 3; the machine has x, y"
    assert bench.ask("2b 0621 00 40010000") == abort("062100", INVALID)
    assert bench.handler.requests == wanted
    assert bench.ask("40 0621 00 00000000") == ["4b06210006000000"]


def test_segmented_write_of_a_number(bench: ControllerNodeBench) -> None:
    assert bench.ask("21 0421 01 04000000") == ["6004210100000000"]
    assert bench.handler.changes == []
    assert bench.ask("07 ac0d0000 000000") == ["2000000000000000"]
    assert bench.handler.changes == [("required_m", 3.5e-6)]


def test_segments_may_be_as_small_as_the_client_likes(bench: ControllerNodeBench) -> None:
    bench.ask("20 0421 01 00000000")
    answers = [bench.ask(segment + "00" * 6) for segment in ("0cac", "1c0d", "0c00", "1d00")]
    assert answers == [[f"{toggle}00000000000000"] for toggle in ("20", "30", "20", "30")]
    assert bench.handler.changes == [("required_m", 3.5e-6)]


def test_segmented_write_that_is_too_long_or_too_short_writes_nothing(bench: ControllerNodeBench) -> None:
    bench.ask("21 0421 01 04000000")
    assert bench.ask("05 ac0d000000 0000") == abort("042101", TOO_LONG)
    bench.ask("21 0421 01 04000000")
    assert bench.ask("0b ac0d 0000000000") == abort("042101", TOO_SHORT)
    assert bench.handler.changes == []


def test_segmented_upload_of_the_reason(bench: ControllerNodeBench) -> None:
    bench.handler.set_learning("x", LearningState.FAILED, None, "axis x: following error")
    assert bench.ask("40 1221 00 00000000") == ["4112210017000000"]
    text = b""
    for command in ("60", "70", "60", "70"):
        (answer,) = bench.ask(command + "00" * 7)
        frame = bytes.fromhex(answer)
        assert frame[0] & 0x10 == int(command, 16) & 0x10
        text += frame[1 : 8 - (frame[0] >> 1 & 7)]
    assert frame[0] & 1
    assert text == b"axis x: following error"
    assert bench.ask("60" + "00" * 7) == abort("000000", COMMAND)  # of no transfer


def test_block_upload_may_become_segmented_where_the_client_allows_it(bench: ControllerNodeBench) -> None:
    assert bench.ask("a4 0010 00 7f 04 0000") == [DEVICE_TYPE]
    assert bench.ask("a4 0810 00 7f 09 0000") == ["c60810000a000000"]
    assert bench.ask("a4 0810 00 7f 0a 0000") == ["410810000a000000"]


def test_wrong_toggle_ends_a_transfer(bench: ControllerNodeBench) -> None:
    bench.ask("40 0810 00 00000000")
    assert bench.ask("70" + "00" * 7) == abort("081000", TOGGLE)
    assert bench.ask("60" + "00" * 7) == abort("000000", COMMAND)
    bench.ask("21 0421 01 04000000")
    assert bench.ask("17 ac0d0000 000000") == abort("042101", TOGGLE)
    assert bench.ask("07 ac0d0000 000000") == abort("000000", COMMAND)
    assert bench.handler.changes == []


def test_segment_without_a_transfer_is_refused(bench: ControllerNodeBench) -> None:
    assert bench.ask("60" + "00" * 7) == abort("000000", COMMAND)
    assert bench.ask("01" + "00" * 7) == abort("000000", COMMAND)


def test_an_unfinished_transfer_does_not_affect_the_next(bench: ControllerNodeBench) -> None:
    bench.ask("21 0421 01 04000000")
    assert bench.ask("40 0010 00 00000000") == [DEVICE_TYPE]
    assert bench.ask("07 ac0d0000 000000") == abort("000000", COMMAND)  # of no transfer
    assert bench.handler.changes == []


def test_abort_of_the_client_ends_its_transfer_without_an_answer(bench: ControllerNodeBench) -> None:
    bench.ask("40 0810 00 00000000")
    assert bench.ask("80 0810 00 00000405") == []
    assert bench.ask("60" + "00" * 7) == abort("000000", COMMAND)


@pytest.mark.parametrize("frame", ["", "40", "40 0010 00 000000"])
def test_a_short_frame_is_no_request(bench: ControllerNodeBench, frame: str) -> None:
    assert bench.ask(frame) == []


def test_noise_on_the_sdo_channel_gets_at_most_one_block_a_frame_and_the_node_goes_on(
    bench: ControllerNodeBench,
) -> None:
    noise = random.Random(3)
    bench.handler.set_axis(
        0, last=REVERSAL, learned=LEARNED, version=1, learned_at="2026-11-21T10:00:00+00:00"
    )
    for _ in range(5_000):
        frame = noise.randbytes(noise.choice((0, 3, 8, 8, 8, 8)))
        if len(frame) == 8 and noise.random() < 0.8:  # mostly at objects that there are
            index = noise.choice((0x1003, 0x1016, 0x1800, 0x2100, 0x2104, 0x2110, 0x2121, 0x2131, 0x2141))
            frame = frame[:1] + index.to_bytes(2, "little") + bytes((noise.randrange(12),)) + frame[4:]
        assert len(bench.ask(frame.hex())) <= 127  # a block
    bench.ask("80" + "00" * 7)  # a block download that it may have begun
    assert bench.ask("40 0010 00 00000000") == [DEVICE_TYPE]
