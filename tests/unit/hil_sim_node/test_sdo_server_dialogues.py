"""Scripted dialogues with the SDO server: frames in, frames out, by CiA 301 section 7.2.4."""

import binascii

import pytest
from in_process_nodes import DRIVE, InProcessNodes

TOGGLE = 0x05030000
COMMAND = 0x05040001
BLOCK_SIZE = 0x05040002
SEQUENCE = 0x05040003
CRC = 0x05040004
READ_ONLY = 0x06010002
NO_OBJECT = 0x06020000
LENGTH = 0x06070010
NO_SUBINDEX = 0x06090011
NO_DATA = 0x08000024


@pytest.fixture
def desk() -> InProcessNodes:
    desk = InProcessNodes()
    desk.frames.clear()
    return desk


def ask(desk: InProcessNodes, request: str) -> list[str]:
    """Send a request given in hex (blanks ignored), return the answers likewise."""
    desk.frames.clear()
    desk.put(0x600 + DRIVE, bytes.fromhex(request))
    return [data.hex() for can_id, data in desk.frames if can_id == 0x580 + DRIVE]


def abort(index_and_sub: str, code: int) -> list[str]:
    return ["80" + index_and_sub + code.to_bytes(4, "little").hex()]


def user_data(desk: InProcessNodes) -> bytes:
    return desk.bench.slaves[0].dictionary.get_data(0x2000, 0)


def test_expedited_upload_of_the_device_type(desk: InProcessNodes) -> None:
    assert ask(desk, "40 0010 00 00000000") == ["4300100092010200"]


def test_expedited_download_and_upload_of_two_bytes(desk: InProcessNodes) -> None:
    assert ask(desk, "2b 1710 00 e8030000") == ["6017100000000000"]
    assert ask(desk, "40 1710 00 00000000") == ["4b171000e8030000"]


@pytest.mark.parametrize(
    ("request_hex", "address", "code"),
    [
        ("40 0020 01 00000000", "002001", NO_SUBINDEX),
        ("40 3412 00 00000000", "341200", NO_OBJECT),
        ("40 1610 05 00000000", "161005", NO_SUBINDEX),
        ("23 0010 00 01000000", "001000", READ_ONLY),
        ("2f 1710 00 01000000", "171000", LENGTH),
        ("21 0010 00 08000000", "001000", READ_ONLY),
        ("c2 0010 00 08000000", "001000", READ_ONLY),
        ("e0 0000 00 00000000", "000000", COMMAND),
    ],
)
def test_refusals(desk: InProcessNodes, request_hex: str, address: str, code: int) -> None:
    assert ask(desk, request_hex) == abort(address, code)


def test_segmented_upload_of_the_device_name(desk: InProcessNodes) -> None:
    assert ask(desk, "40 0810 00 00000000") == ["4108100015000000"]
    text = b""
    for command in ("60", "70", "60"):
        (answer,) = ask(desk, command + "00" * 7)
        frame = bytes.fromhex(answer)
        text += frame[1 : 8 - (frame[0] >> 1 & 7)]
    assert frame[0] & 1
    assert text == b"Simulated servo drive"


def test_wrong_toggle_ends_a_segmented_upload(desk: InProcessNodes) -> None:
    ask(desk, "40 0810 00 00000000")
    assert ask(desk, "70" + "00" * 7) == abort("081000", TOGGLE)
    assert ask(desk, "60" + "00" * 7) == abort("081000", COMMAND)


def test_wrong_toggle_ends_a_segmented_download(desk: InProcessNodes) -> None:
    ask(desk, "21 0020 00 0e000000")
    assert ask(desk, "00" + "41" * 7) == ["2000000000000000"]
    assert ask(desk, "00" + "41" * 7) == abort("002000", TOGGLE)


def test_segment_without_a_transfer_is_refused(desk: InProcessNodes) -> None:
    assert ask(desk, "60" + "00" * 7) == abort("000000", COMMAND)


def test_segmented_download_longer_than_announced_is_refused(desk: InProcessNodes) -> None:
    ask(desk, "21 0020 00 05000000")
    assert ask(desk, "01" + "41" * 7) == abort("002000", LENGTH)


def test_a_new_initiate_replaces_a_transfer_in_progress(desk: InProcessNodes) -> None:
    ask(desk, "21 0020 00 0e000000")
    assert ask(desk, "40 0010 00 00000000") == ["4300100092010200"]


def test_a_stopped_node_does_not_answer(desk: InProcessNodes) -> None:
    desk.put(0x000, bytes((2, DRIVE)))
    assert ask(desk, "40 0010 00 00000000") == []


def test_a_short_frame_is_no_request(desk: InProcessNodes) -> None:
    assert ask(desk, "40 0010") == []


def test_block_download_of_two_segments_with_crc(desk: InProcessNodes) -> None:
    data = b"0123456789"
    assert ask(desk, "c6 0020 00 0a000000") == ["a40020007f000000"]
    assert ask(desk, "01" + data[:7].hex()) == []
    assert ask(desk, "82" + data[7:].hex() + "00" * 4) == ["a2027f0000000000"]
    crc = binascii.crc_hqx(data, 0).to_bytes(2, "little").hex()
    assert ask(desk, "d1" + crc + "00" * 5) == ["a100000000000000"]
    assert user_data(desk) == data


def test_block_download_asks_again_for_a_lost_segment(desk: InProcessNodes) -> None:
    data = bytes(range(21))
    ask(desk, "c2 0020 00 15000000")
    assert ask(desk, "01" + data[:7].hex()) == []
    assert ask(desk, "83" + data[14:].hex()) == ["a2017f0000000000"]  # segment 2 never came
    assert ask(desk, "01" + data[7:14].hex()) == []
    assert ask(desk, "82" + data[14:].hex()) == ["a2027f0000000000"]
    assert ask(desk, "c1" + "00" * 7) == ["a100000000000000"]
    assert user_data(desk) == data


def test_block_download_with_a_wrong_crc_stores_nothing(desk: InProcessNodes) -> None:
    ask(desk, "c6 0020 00 07000000")
    ask(desk, "81" + "55" * 7)
    assert ask(desk, "c1 3412" + "00" * 5) == abort("002000", CRC)
    assert 0x2000 not in desk.bench.slaves[0].dictionary.data_store


def test_block_download_of_the_wrong_length_is_refused(desk: InProcessNodes) -> None:
    ask(desk, "c2 0020 00 09000000")
    ask(desk, "81" + "55" * 7)
    assert ask(desk, "c1" + "00" * 7) == abort("002000", LENGTH)


def test_block_download_ends_on_the_clients_abort(desk: InProcessNodes) -> None:
    ask(desk, "c2 0020 00 0e000000")
    ask(desk, "01" + "55" * 7)
    assert ask(desk, "80 0020 00 00000008") == []
    assert ask(desk, "02" + "55" * 7) == abort("002000", COMMAND)


def test_a_silent_client_is_forgotten(desk: InProcessNodes) -> None:
    """Half a block download would take the next client's request for a segment out of order."""
    server = desk.bench.slaves[0].dictionary.server
    server.now_s = lambda: 10.0
    ask(desk, "c2 0020 00 0e000000")
    server.now_s = lambda: 10.9
    assert ask(desk, "40 0010 00 00000000") == []
    server.now_s = lambda: 12.0
    assert ask(desk, "40 0010 00 00000000") == ["4300100092010200"]


def test_block_upload_in_blocks_of_two(desk: InProcessNodes) -> None:
    assert ask(desk, "a4 0810 00 02 000000") == ["c608100015000000"]
    assert ask(desk, "a3" + "00" * 7) == ["01" + b"Simulat".hex(), "02" + b"ed serv".hex()]
    assert ask(desk, "a2 02 7f" + "00" * 5) == ["81" + b"o drive".hex()]
    crc = binascii.crc_hqx(b"Simulated servo drive", 0).to_bytes(2, "little").hex()
    assert ask(desk, "a2 01 7f" + "00" * 5) == ["c1" + crc + "00" * 5]
    assert ask(desk, "a1" + "00" * 7) == []


def test_block_upload_repeats_what_was_not_acknowledged(desk: InProcessNodes) -> None:
    ask(desk, "a0 0810 00 7f 000000")
    first = ask(desk, "a3" + "00" * 7)
    assert len(first) == 3
    assert ask(desk, "a2 01 7f" + "00" * 5) == ["01" + b"ed serv".hex(), "82" + b"o drive".hex()]
    assert ask(desk, "a2 02 7f" + "00" * 5) == ["c100000000000000"]


@pytest.mark.parametrize(
    ("request_hex", "code"),
    [
        ("a2 04 7f 00 00000000", SEQUENCE),
        ("a2 03 00 00 00000000", BLOCK_SIZE),
        ("a1 00 00 00 00000000", COMMAND),
    ],
)
def test_block_upload_refuses_impossible_answers(desk: InProcessNodes, request_hex: str, code: int) -> None:
    ask(desk, "a0 0810 00 7f 000000")
    ask(desk, "a3" + "00" * 7)
    assert ask(desk, request_hex) == abort("081000", code)


def test_block_upload_refuses_block_size_zero(desk: InProcessNodes) -> None:
    assert ask(desk, "a0 0810 00 00 000000") == abort("081000", BLOCK_SIZE)


def test_upload_of_nothing_says_so(desk: InProcessNodes) -> None:
    desk.bench.slaves[0].dictionary.data_store[0x2000] = {0: b""}
    assert ask(desk, "40 0020 00 00000000") == abort("002000", NO_DATA)
    assert ask(desk, "a0 0020 00 7f 000000") == abort("002000", NO_DATA)


@pytest.mark.parametrize("command", ["8101", "8201", "0201 8001"])
def test_a_change_of_the_nodes_state_ends_a_transfer(desk: InProcessNodes, command: str) -> None:
    ask(desk, "c6 0020 00 0e000000")  # a block download that would swallow what follows
    for nmt in command.split():
        desk.put(0x000, bytes.fromhex(nmt))
    assert ask(desk, "40 0010 00 00000000") == ["4300100092010200"]
