"""LSS slave against canopen's LSS master: ids and bit rates are configured, stored and used (CiA 305)."""

from pathlib import Path

import canopen
import pytest
from canopen import lss
from in_process_nodes import DRIVE, IDEAL_AXIS, SCALE, InProcessNodes, SdoDrive

from hil_sim.config import ConfigError

VENDOR, REVISION = 0xFFFE, 0x10000
DRIVE_ADDRESS, SCALE_ADDRESS = (VENDOR, 0x402, REVISION, 0x10001), (VENDOR, 0x406, REVISION, 0x1000B)
RESET_COMMUNICATION, START = 130, 1


@pytest.fixture(autouse=True)
def no_pauses(monkeypatch: pytest.MonkeyPatch) -> None:
    """Remove canopen's pauses and waits: here an answer arrives at once or never."""
    monkeypatch.setattr(lss.time, "sleep", lambda _seconds: None)
    monkeypatch.setattr(canopen.lss.LssMaster, "RESPONSE_TIMEOUT", 0.0001)


def unnamed(tmp_path: Path, state: Path | None = None) -> InProcessNodes:
    """Return the nodes of the axis, neither with a node id."""
    text = IDEAL_AXIS.read_text(encoding="utf-8")
    text = text.replace("node_id = 11", "node_id = 255").replace("node_id = 1\n", "node_id = 255\n")
    plant = tmp_path / "unnamed.toml"
    plant.write_text(text.replace("../../eds", str(IDEAL_AXIS.parents[2] / "eds")), encoding="utf-8")
    return InProcessNodes(plant, state)


def select(nodes: InProcessNodes, address: tuple[int, int, int, int]) -> None:
    assert nodes.network.lss.send_switch_state_selective(*address)


def refuses(request: object) -> bool:
    try:
        request()  # type: ignore[operator]
    except lss.LssError:
        return True
    return False


def test_a_selected_node_reports_its_address_and_id() -> None:
    nodes = InProcessNodes()
    master = nodes.network.lss
    select(nodes, SCALE_ADDRESS)
    assert [master.inquire_lss_address(0x5A + word) for word in range(4)] == list(SCALE_ADDRESS)
    assert master.inquire_node_id() == SCALE


@pytest.mark.parametrize("word", range(4))
def test_another_address_selects_no_node(word: int) -> None:
    nodes = InProcessNodes()
    address = list(DRIVE_ADDRESS)
    address[word] += 1
    assert refuses(lambda: nodes.network.lss.send_switch_state_selective(*address))
    assert refuses(nodes.network.lss.inquire_node_id)


def test_an_id_counts_from_the_next_reset_of_the_communication() -> None:
    nodes = InProcessNodes()
    select(nodes, DRIVE_ADDRESS)
    nodes.network.lss.configure_node_id(5)
    nodes.network.lss.send_switch_state_global(0)
    assert SdoDrive(nodes).get(0x1000) == 0x20192
    nodes.frames.clear()
    nodes.put(0, bytes((RESET_COMMUNICATION, DRIVE)))
    assert nodes.take(0x705) == [b"\0"]
    renamed = nodes.remote(5)
    assert renamed.sdo[0x1400][1].raw == 0x205
    assert renamed.sdo[0x1018][4].raw == DRIVE_ADDRESS[3]  # it is the same device
    nodes.operational()
    nodes.put(0x205, b"\x06\x00")
    assert renamed.sdo[0x6040].raw == 6


def test_what_cannot_be_is_refused() -> None:
    nodes = InProcessNodes()
    select(nodes, DRIVE_ADDRESS)
    master = nodes.network.lss
    assert refuses(lambda: master.configure_node_id(0))
    assert refuses(lambda: master.configure_node_id(128))
    for rate in (5, 8, 9, 255):  # reserved, 10 kbit/s, automatic, none
        assert refuses(lambda rate=rate: master.configure_bit_timing(rate))
    nodes.frames.clear()
    nodes.put(0x7E5, bytes((0x13, 1, 2)).ljust(8, b"\0"))  # a table of somebody's own
    assert nodes.take(0x7E4) == [bytes((0x13, 1)).ljust(8, b"\0")]
    assert master.inquire_node_id() == DRIVE


def test_an_operational_node_is_not_named() -> None:
    nodes = InProcessNodes()
    nodes.put(0, bytes((START, DRIVE)))
    assert refuses(lambda: nodes.network.lss.send_switch_state_selective(*DRIVE_ADDRESS))
    select(nodes, SCALE_ADDRESS)


def test_nodes_in_a_range_of_serial_numbers_answer() -> None:
    nodes = InProcessNodes()
    for low, high, answers in ((0x10000, 0x10001, 1), (0x10002, 0x20000, 0)):
        nodes.frames.clear()
        for step, number in enumerate((VENDOR, 0x402, 0, REVISION, low, high)):
            nodes.put(0x7E5, bytes((0x46 + step,)) + number.to_bytes(4, "little") + bytes(3))
        assert len(nodes.take(0x7E4)) == answers


def test_a_node_without_an_id_is_silent_but_for_lss(tmp_path: Path) -> None:
    nodes = unnamed(tmp_path)
    assert nodes.frames == []
    nodes.operational()
    nodes.sync(5)
    assert nodes.frames == []
    nodes.put(0x7E5, b"\x4c".ljust(8, b"\0"))
    assert nodes.take(0x7E4) == [b"\x50".ljust(8, b"\0")] * 2


def test_fastscan_finds_and_names_every_node_on_a_new_bus(tmp_path: Path) -> None:
    nodes = unnamed(tmp_path, tmp_path)
    master = nodes.network.lss
    found = []
    for node_id in (21, 22):
        there, address = master.fast_scan()
        assert there
        found.append(tuple(address))
        master.configure_node_id(node_id)
        master.store_configuration()
        nodes.frames.clear()
        master.send_switch_state_global(0)
        assert nodes.take(0x700 + node_id) == [b"\0"]
    assert sorted(found) == [(VENDOR, 0x402, REVISION, 0x10100), (VENDOR, 0x406, REVISION, 0x10101)]
    assert master.fast_scan() == (False, None)
    again = unnamed(tmp_path, tmp_path)  # switched off and on
    assert sorted(again.frames) == [(0x715, b"\0"), (0x716, b"\0")]


def test_a_node_may_lose_its_id() -> None:
    nodes = InProcessNodes()
    select(nodes, SCALE_ADDRESS)
    nodes.network.lss.configure_node_id(255)
    nodes.network.lss.send_switch_state_global(0)
    nodes.frames.clear()
    nodes.put(0, bytes((RESET_COMMUNICATION, SCALE)))
    assert nodes.frames == []
    assert nodes.network.lss.fast_scan() == (True, list(SCALE_ADDRESS))


def heartbeats(nodes: InProcessNodes, cycles: int) -> set[int]:
    """Return the nodes that send frames within these cycles."""
    nodes.frames.clear()
    nodes.sync(cycles)
    return {can_id - 0x700 for can_id, _ in nodes.frames if can_id > 0x700 and can_id < 0x780}


def test_a_rate_is_taken_after_the_delay_and_nothing_is_sent_for_as_long_again() -> None:
    nodes = InProcessNodes()
    for node_id in (DRIVE, SCALE):
        nodes.remote(node_id).sdo[0x1017].raw = 1
    master = nodes.network.lss
    master.send_switch_state_global(1)
    nodes.put(0x7E5, bytes((0x13, 0, 2)).ljust(8, b"\0"))
    assert heartbeats(nodes, 3) == {DRIVE, SCALE}
    master.activate_bit_timing(20)
    assert heartbeats(nodes, 39) == set()
    assert heartbeats(nodes, 3) == {DRIVE, SCALE}
    assert {slave.rate.kbit_s for slave in nodes.bench.slaves} == {500}


def test_a_node_at_another_rate_neither_receives_nor_sends() -> None:
    nodes = InProcessNodes()
    for node_id in (DRIVE, SCALE):
        nodes.remote(node_id).sdo[0x1017].raw = 1
    select(nodes, SCALE_ADDRESS)
    master = nodes.network.lss
    master.configure_bit_timing(3)
    master.activate_bit_timing(2)
    nodes.sync(5)
    assert heartbeats(nodes, 10) == {SCALE}
    master.send_switch_state_global(0)
    nodes.operational()
    assert nodes.remote(SCALE).sdo[0x6004].raw == 0
    assert nodes.bench.slaves[0].nmt.state == 127
    nodes.put(0, bytes((128, 0)))
    select(nodes, SCALE_ADDRESS)
    master.configure_bit_timing(0)
    master.activate_bit_timing(2)
    nodes.sync(5)
    assert heartbeats(nodes, 10) == {DRIVE, SCALE}


def test_a_stored_rate_is_that_of_the_next_power_up(tmp_path: Path) -> None:
    nodes = unnamed(tmp_path, tmp_path)
    master = nodes.network.lss
    master.fast_scan()
    master.configure_node_id(21)
    master.configure_bit_timing(4)
    master.store_configuration()
    assert nodes.bench.slaves[0].rate.kbit_s == 1000
    again = unnamed(tmp_path, tmp_path)
    rates = sorted(slave.rate.kbit_s for slave in again.bench.slaves)
    assert rates == [125, 1000]
    (tmp_path / "serial_00010100_id.json").write_text('{"format": 1, "node_id": 21, "bit_rate_kbit_s": 3}')
    with pytest.raises(ConfigError, match="no bit rate"):
        unnamed(tmp_path, tmp_path)
