"""Our LSS master names simulated nodes: on a new bus, on one with ids, and refuses what would collide."""

from pathlib import Path

import pytest
from in_process_nodes import IDEAL_AXIS, InProcessNodes

from servo_ctrl.cli import conformance_request
from servo_ctrl.conformance.dialogue import Failed
from servo_ctrl.conformance.lss_master import Address, configure_ids, find_unnamed, set_bit_rate
from servo_ctrl.conformance.scan import scan

DRIVE_ADDRESS = Address(0xFFFE, 0x402, 0x10000, 0x10100)
SCALE_ADDRESS = Address(0xFFFE, 0x406, 0x10000, 0x10101)


class Wire:
    """Nodes in this process; what has not come at once does not come."""

    def __init__(self, nodes: InProcessNodes) -> None:
        self.nodes = nodes
        nodes.frames.clear()

    def send(self, can_id: int, data: bytes) -> None:
        self.nodes.put(can_id, data)

    def receive(self, timeout_s: float) -> tuple[int, bytes] | None:
        del timeout_s
        return self.nodes.frames.pop(0) if self.nodes.frames else None


@pytest.fixture
def new_bus(tmp_path: Path) -> Wire:
    text = IDEAL_AXIS.read_text(encoding="utf-8").replace("../../eds", str(IDEAL_AXIS.parents[2] / "eds"))
    text = text.replace("node_id = 11", "node_id = 255").replace("node_id = 1\n", "node_id = 255\n")
    plant = tmp_path / "plant.toml"
    plant.write_text(text, encoding="utf-8")
    return Wire(InProcessNodes(plant))


def test_nodes_of_a_new_bus_are_found_and_wait_again(new_bus: Wire) -> None:
    assert find_unnamed(new_bus) == [DRIVE_ADDRESS, SCALE_ADDRESS]
    assert find_unnamed(new_bus) == [DRIVE_ADDRESS, SCALE_ADDRESS]
    assert scan(new_bus) == []


def test_no_node_is_found_where_all_have_ids() -> None:
    assert find_unnamed(Wire(InProcessNodes())) == []


def test_the_command_names_a_new_bus_and_renames_a_node(new_bus: Wire) -> None:
    conformance_request.assign_ids(new_bus, {0x10100: 3, 0x10101: 13})
    assert [(node.node_id, node.profile) for node in scan(new_bus)] == [(3, 402), (13, 406)]
    conformance_request.assign_ids(new_bus, {0x10100: 4})
    assert [(node.node_id, node.serial) for node in scan(new_bus)] == [(4, 0x10100), (13, 0x10101)]


def test_two_nodes_exchange_their_ids() -> None:
    wire = Wire(InProcessNodes())
    conformance_request.assign_ids(wire, {0x10001: 11, 0x1000B: 1})
    assert [(node.node_id, node.profile) for node in scan(wire)] == [(1, 406), (11, 402)]


@pytest.mark.parametrize(
    ("names", "reason"),
    [({0x10001: 11}, "node id 11 is taken"), ({0x77: 5}, "0 nodes have the serial number 77h")],
)
def test_nothing_is_given_that_cannot_be(names: dict[int, int], reason: str) -> None:
    wire = Wire(InProcessNodes())
    with pytest.raises(Failed, match=reason):
        conformance_request.assign_ids(wire, names)
    assert [node.node_id for node in scan(wire)] == [1, 11]


def test_an_operational_node_is_not_renamed() -> None:
    wire = Wire(InProcessNodes())
    wire.nodes.operational()
    with pytest.raises(Failed, match="no LSS"):
        configure_ids(wire, [(Address(0xFFFE, 0x402, 0x10000, 0x10001), 5, 1)])


def rates(wire: Wire) -> list[int]:
    return [slave.rate.kbit_s for slave in wire.nodes.bench.slaves]


def test_all_nodes_take_another_bit_rate_together(new_bus: Wire) -> None:
    conformance_request.assign_ids(new_bus, {0x10100: 3})
    addresses = [*find_unnamed(new_bus), *conformance_request.addresses_of(scan(new_bus))]
    assert sorted(addresses) == [DRIVE_ADDRESS, SCALE_ADDRESS]
    set_bit_rate(new_bus, addresses, 250, 5)
    new_bus.nodes.sync(12)
    assert rates(new_bus) == [250, 250]
    new_bus.send(0x7E5, bytes((4, 0)).ljust(8, b"\0"))
    assert [node.node_id for node in scan(new_bus)] == [3]


def test_a_rate_that_one_node_has_not_is_given_to_none(tmp_path: Path) -> None:
    wire = Wire(InProcessNodes(state_directory=tmp_path))
    addresses = list(conformance_request.addresses_of(scan(wire)))
    with pytest.raises(Failed, match=r"00010001h: 10 kbit/s: refused with LSS error 1"):
        set_bit_rate(wire, addresses, 10, None)
    assert not list(tmp_path.glob("*_id.json"))
    set_bit_rate(wire, addresses, 20, None)
    assert rates(wire) == [1000, 1000]
    assert rates(Wire(InProcessNodes(state_directory=tmp_path))) == [20, 20]
