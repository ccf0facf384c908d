"""Block transfers with the controller's SDO server, by CiA 301, section 7.2.4."""

from binascii import crc_hqx

import pytest
from controller_node_bench import OWN_EDS, ControllerNodeBench, abort

from servo_ctrl.canopen.sdo_server import BLOCK_TIMEOUT_S
from servo_ctrl.commands.eds_sections import eds_of

BLOCK_NUMBER, BLOCK_CRC = 0x05040003, 0x05040004
TIMED_OUT, COMMAND = 0x05040000, 0x05040001
DEVICE_TYPE = "4300100000000000"


@pytest.fixture
def bench() -> ControllerNodeBench:
    return ControllerNodeBench.booted()


def test_our_eds_is_sent_in_blocks_that_canopens_client_checks(bench: ControllerNodeBench) -> None:
    with bench.remote.sdo[0x1021].open("rb", block_transfer=True) as stream:
        text = stream.read().decode("ascii")
    assert text == eds_of(OWN_EDS.read_text(encoding="ascii"), 2)
    assert "[2112]" in text
    assert "[2113]" in text
    assert bench.remote.sdo[0x1022].raw == 0


def test_a_segment_that_was_lost_is_sent_again(bench: ControllerNodeBench) -> None:
    """1008h, "servo_ctrl", in a block of two segments, of which the first alone arrives."""
    bench.ask("a4 0810 00 02 00 0000")
    first, second = bench.ask("a3" + "00" * 7)
    assert (first, second) == ("01" + b"servo_c".hex(), "82" + b"trl".hex() + "00" * 4)
    assert bench.ask("a2 01 02" + "00" * 5) == ["81" + second[2:]]
    crc = crc_hqx(b"servo_ctrl", 0).to_bytes(2, "little").hex()
    assert bench.ask("a2 01 02" + "00" * 5) == [f"d1{crc}" + "00" * 5]
    assert bench.ask("a1" + "00" * 7) == []
    assert bench.ask("40 0010 00 00000000") == [DEVICE_TYPE]


def test_a_number_is_written_in_a_block(bench: ControllerNodeBench) -> None:
    """2104h:01, required J: 3500 nm."""
    assert bench.ask("c6 0421 01 04000000") == ["a404210 17f000000".replace(" ", "")]
    assert bench.ask("81 ac0d0000 000000") == ["a2017f0000000000"]
    crc = crc_hqx(bytes.fromhex("ac0d0000"), 0).to_bytes(2, "little").hex()
    assert bench.ask(f"cd {crc}" + "00" * 5) == ["a100000000000000"]
    assert len(bench.handler.changes) == 1


def test_a_block_with_a_wrong_crc_or_number_is_not_written(bench: ControllerNodeBench) -> None:
    bench.ask("c6 0421 01 04000000")
    bench.ask("81 ac0d0000 000000")
    assert bench.ask("cd 1234" + "00" * 5) == abort("042101", BLOCK_CRC)
    bench.ask("c6 0421 01 04000000")
    assert bench.ask("80" + "00" * 7) == []  # the client's abort
    bench.ask("c6 0421 01 04000000")
    assert bench.ask("00" + "00" * 7) == abort("042101", BLOCK_NUMBER)
    assert bench.handler.changes == []


def test_a_client_that_has_been_silent_has_gone(bench: ControllerNodeBench) -> None:
    bench.ask("a4 0810 00 02 00 0000")
    bench.clock_s += BLOCK_TIMEOUT_S
    assert len(bench.ask("a3" + "00" * 7)) == 2
    bench.clock_s += 1.01 * BLOCK_TIMEOUT_S
    assert bench.ask("a2 01 02" + "00" * 5) == abort("081000", TIMED_OUT)
    assert bench.ask("a2 01 02" + "00" * 5) == abort("000000", COMMAND)  # a frame of no transfer


def test_while_sync_runs_segments_leave_one_a_cycle(bench: ControllerNodeBench) -> None:
    """127 at once are 16 ms of a bus of 1 Mbit/s, in which no SYNC would be sent."""
    bench.node.count_cycles(1)
    assert bench.ask("a4 2110 00 7f 000000")[0].startswith("c6211000")
    assert bench.ask("a3" + "00" * 7) == []
    for number in range(1, 128):
        bench.frames.clear()
        bench.clock_s += 0.1 * BLOCK_TIMEOUT_S  # the client's second begins with the last segment
        bench.node.count_cycles(1)
        assert [data[0] for can_id, data in bench.frames if can_id == 0x5FF] == [number]
    bench.node.count_cycles(1)
    bench.clock_s += 0.9 * BLOCK_TIMEOUT_S
    assert bench.ask("a2 7f 02" + "00" * 5) == []
    bench.node.count_cycles(1)
    assert bench.ask("80 2110 00 00000405") == []
    bench.frames.clear()
    bench.node.count_cycles(1)
    assert [data for can_id, data in bench.frames if can_id == 0x5FF] == []  # the client has aborted
