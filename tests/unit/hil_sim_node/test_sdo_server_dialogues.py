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
TOO_LONG = 0x06070012
TOO_SHORT = 0x06070013
TIMED_OUT = 0x05040000
NO_TRANSFER = "000000"
NO_SUBINDEX = 0x06090011
NO_DATA = 0x08000024


@pytest.fixture
def nodes() -> InProcessNodes:
    nodes = InProcessNodes()
    nodes.frames.clear()
    return nodes


def ask(nodes: InProcessNodes, request: str) -> list[str]:
    """Send a request given in hex (blanks ignored), return the answers likewise."""
    nodes.frames.clear()
    nodes.put(0x600 + DRIVE, bytes.fromhex(request))
    return [data.hex() for can_id, data in nodes.frames if can_id == 0x580 + DRIVE]


def abort(index_and_sub: str, code: int) -> list[str]:
    return ["80" + index_and_sub + code.to_bytes(4, "little").hex()]


def user_data(nodes: InProcessNodes) -> bytes:
    return nodes.bench.slaves[0].dictionary.get_data(0x2000, 0)


def test_expedited_upload_of_the_device_type(nodes: InProcessNodes) -> None:
    assert ask(nodes, "40 0010 00 00000000") == ["4300100092010200"]


def test_expedited_download_and_upload_of_two_bytes(nodes: InProcessNodes) -> None:
    assert ask(nodes, "2b 1710 00 e8030000") == ["6017100000000000"]
    assert ask(nodes, "40 1710 00 00000000") == ["4b171000e8030000"]


@pytest.mark.parametrize(
    ("request_hex", "address", "code"),
    [
        ("40 0020 01 00000000", "002001", NO_SUBINDEX),
        ("40 3412 00 00000000", "341200", NO_OBJECT),
        ("40 1610 05 00000000", "161005", NO_SUBINDEX),
        ("23 0010 00 01000000", "001000", READ_ONLY),
        ("2f 1710 00 01000000", "171000", TOO_SHORT),
        ("23 1710 00 01000000", "171000", TOO_LONG),
        ("40 0200 00 00000000", "020000", NO_OBJECT),
        ("21 0010 00 08000000", "001000", READ_ONLY),
        ("c2 0010 00 08000000", "001000", READ_ONLY),
        ("e0 0000 00 00000000", "000000", COMMAND),
    ],
)
def test_refused_transfers_abort_with_their_code(
    nodes: InProcessNodes, request_hex: str, address: str, code: int
) -> None:
    assert ask(nodes, request_hex) == abort(address, code)


def test_segmented_upload_of_the_device_name(nodes: InProcessNodes) -> None:
    assert ask(nodes, "40 0810 00 00000000") == ["4108100015000000"]
    text = b""
    for command in ("60", "70", "60"):
        (answer,) = ask(nodes, command + "00" * 7)
        frame = bytes.fromhex(answer)
        text += frame[1 : 8 - (frame[0] >> 1 & 7)]
    assert frame[0] & 1
    assert text == b"Simulated servo drive"


def test_wrong_toggle_ends_a_segmented_upload(nodes: InProcessNodes) -> None:
    ask(nodes, "40 0810 00 00000000")
    assert ask(nodes, "70" + "00" * 7) == abort("081000", TOGGLE)
    assert ask(nodes, "60" + "00" * 7) == abort(NO_TRANSFER, COMMAND)


def test_wrong_toggle_ends_a_segmented_download(nodes: InProcessNodes) -> None:
    ask(nodes, "21 0020 00 0e000000")
    assert ask(nodes, "00" + "41" * 7) == ["2000000000000000"]
    assert ask(nodes, "00" + "41" * 7) == abort("002000", TOGGLE)


def test_segment_without_a_transfer_is_refused(nodes: InProcessNodes) -> None:
    assert ask(nodes, "60" + "00" * 7) == abort("000000", COMMAND)


def test_segmented_download_longer_than_announced_is_refused(nodes: InProcessNodes) -> None:
    ask(nodes, "21 0020 00 05000000")
    assert ask(nodes, "01" + "41" * 7) == abort("002000", TOO_LONG)


def test_a_new_initiate_replaces_a_transfer_in_progress(nodes: InProcessNodes) -> None:
    ask(nodes, "21 0020 00 0e000000")
    assert ask(nodes, "40 0010 00 00000000") == ["4300100092010200"]


def test_a_stopped_node_does_not_answer(nodes: InProcessNodes) -> None:
    nodes.put(0x000, bytes((2, DRIVE)))
    assert ask(nodes, "40 0010 00 00000000") == []


def test_a_short_frame_is_no_request(nodes: InProcessNodes) -> None:
    assert ask(nodes, "40 0010") == []


def test_block_download_of_two_segments_with_crc(nodes: InProcessNodes) -> None:
    data = b"0123456789"
    assert ask(nodes, "c6 0020 00 0a000000") == ["a40020007f000000"]
    assert ask(nodes, "01" + data[:7].hex()) == []
    assert ask(nodes, "82" + data[7:].hex() + "00" * 4) == ["a2027f0000000000"]
    crc = binascii.crc_hqx(data, 0).to_bytes(2, "little").hex()
    assert ask(nodes, "d1" + crc + "00" * 5) == ["a100000000000000"]
    assert user_data(nodes) == data


def test_block_download_asks_again_for_a_lost_segment(nodes: InProcessNodes) -> None:
    data = bytes(range(21))
    ask(nodes, "c2 0020 00 15000000")
    assert ask(nodes, "01" + data[:7].hex()) == []
    assert ask(nodes, "83" + data[14:].hex()) == ["a2017f0000000000"]  # segment 2 never came
    assert ask(nodes, "01" + data[7:14].hex()) == []
    assert ask(nodes, "82" + data[14:].hex()) == ["a2027f0000000000"]
    assert ask(nodes, "c1" + "00" * 7) == ["a100000000000000"]
    assert user_data(nodes) == data


def test_block_download_with_a_wrong_crc_stores_nothing(nodes: InProcessNodes) -> None:
    ask(nodes, "c6 0020 00 07000000")
    ask(nodes, "81" + "55" * 7)
    assert ask(nodes, "c1 3412" + "00" * 5) == abort("002000", CRC)
    assert (0x2000, 0) not in nodes.bench.slaves[0].dictionary.stored


def test_block_download_of_the_wrong_length_is_refused(nodes: InProcessNodes) -> None:
    ask(nodes, "c2 0020 00 09000000")
    ask(nodes, "81" + "55" * 7)
    assert ask(nodes, "c1" + "00" * 7) == abort("002000", TOO_SHORT)


def test_block_download_ends_on_the_clients_abort(nodes: InProcessNodes) -> None:
    ask(nodes, "c2 0020 00 0e000000")
    ask(nodes, "01" + "55" * 7)
    assert ask(nodes, "80 0020 00 00000008") == []
    assert ask(nodes, "02" + "55" * 7) == abort(NO_TRANSFER, COMMAND)


def test_a_silent_client_is_forgotten(nodes: InProcessNodes) -> None:
    """Half a block download would take the next client's request for a segment out of order."""
    server = nodes.bench.slaves[0].sdo
    server.now_s = lambda: 10.0
    ask(nodes, "c2 0020 00 0e000000")
    server.now_s = lambda: 10.9
    assert ask(nodes, "40 0010 00 00000000") == []
    server.now_s = lambda: 12.0
    assert ask(nodes, "40 0010 00 00000000") == ["4300100092010200"]


def test_the_clients_patience_begins_with_our_last_frame(nodes: InProcessNodes) -> None:
    """127 segments take 1.7 s at 10 kbit/s; a client that is later than its second gets 05040000h."""
    server = nodes.bench.slaves[0].sdo
    server.now_s = lambda: 10.0
    ask(nodes, "a4 2110 00 7f 000000")
    assert len(ask(nodes, "a3" + "00" * 7)) == 127
    server.now_s = lambda: 12.5
    assert len(ask(nodes, "a2 7f 7f" + "00" * 5)) == 127
    server.now_s = lambda: 15.5
    assert ask(nodes, "a2 7f 7f" + "00" * 5) == abort("211000", TIMED_OUT)
    assert ask(nodes, "a2 7f 7f" + "00" * 5) == abort(NO_TRANSFER, COMMAND)


def test_an_abort_after_an_expedited_transfer_names_no_object(nodes: InProcessNodes) -> None:
    ask(nodes, "40 0010 00 00000000")
    assert ask(nodes, "60" + "00" * 7) == abort(NO_TRANSFER, COMMAND)


def test_block_upload_in_blocks_of_two(nodes: InProcessNodes) -> None:
    assert ask(nodes, "a4 0810 00 02 000000") == ["c608100015000000"]
    assert ask(nodes, "a3" + "00" * 7) == ["01" + b"Simulat".hex(), "02" + b"ed serv".hex()]
    assert ask(nodes, "a2 02 7f" + "00" * 5) == ["81" + b"o drive".hex()]
    crc = binascii.crc_hqx(b"Simulated servo drive", 0).to_bytes(2, "little").hex()
    assert ask(nodes, "a2 01 7f" + "00" * 5) == ["c1" + crc + "00" * 5]
    assert ask(nodes, "a1" + "00" * 7) == []


def test_block_upload_repeats_what_was_not_acknowledged(nodes: InProcessNodes) -> None:
    ask(nodes, "a0 0810 00 7f 000000")
    first = ask(nodes, "a3" + "00" * 7)
    assert len(first) == 3
    assert ask(nodes, "a2 01 7f" + "00" * 5) == ["01" + b"ed serv".hex(), "82" + b"o drive".hex()]
    assert ask(nodes, "a2 02 7f" + "00" * 5) == ["c100000000000000"]


@pytest.mark.parametrize(
    ("request_hex", "code"),
    [
        ("a2 04 7f 00 00000000", SEQUENCE),
        ("a2 03 00 00 00000000", BLOCK_SIZE),
        ("a1 00 00 00 00000000", COMMAND),
    ],
)
def test_block_upload_refuses_impossible_answers(nodes: InProcessNodes, request_hex: str, code: int) -> None:
    ask(nodes, "a0 0810 00 7f 000000")
    ask(nodes, "a3" + "00" * 7)
    assert ask(nodes, request_hex) == abort("081000", code)


def test_block_upload_refuses_block_size_zero(nodes: InProcessNodes) -> None:
    assert ask(nodes, "a0 0810 00 00 000000") == abort("081000", BLOCK_SIZE)


def test_upload_of_an_empty_object_aborts_with_no_data(nodes: InProcessNodes) -> None:
    nodes.bench.slaves[0].dictionary.stored.pop((0x2000, 0), None)
    assert ask(nodes, "40 0020 00 00000000") == abort("002000", NO_DATA)
    assert ask(nodes, "a0 0020 00 7f 000000") == abort("002000", NO_DATA)


@pytest.mark.parametrize("command", ["8101", "8201", "0201 8001"])
def test_a_change_of_the_nodes_state_ends_a_transfer(nodes: InProcessNodes, command: str) -> None:
    ask(nodes, "c6 0020 00 0e000000")  # a block download that would swallow what follows
    for nmt in command.split():
        nodes.put(0x000, bytes.fromhex(nmt))
    assert ask(nodes, "40 0010 00 00000000") == ["4300100092010200"]
