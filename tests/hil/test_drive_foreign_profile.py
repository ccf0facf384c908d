"""canopen's BaseNode402, independent code, operates the drive: states, homing, PP, CSP, CSV, CST.

In one process and in lockstep: a SYNC follows every frame of the master, so its polling makes time pass.
"""

from collections.abc import Callable

import pytest
from canopen.profiles.p402 import BaseNode402
from in_process_nodes import DRIVE, InProcessNodes, counts


@pytest.fixture
def nodes() -> InProcessNodes:
    nodes = InProcessNodes()
    nodes.sync_on_every_frame = True
    return nodes


@pytest.fixture
def node(nodes: InProcessNodes) -> BaseNode402:
    node = nodes.remote(DRIVE, BaseNode402)
    node.nmt.state = "PRE-OPERATIONAL"
    node.sdo[0x1800][
        1
    ].raw = 0xC0000181  # statusword by SDO: nobody sends a SYNC while the master waits for a TPDO
    node.setup_402_state_machine()
    node.nmt.state = "OPERATIONAL"
    return node


def wait(nodes: InProcessNodes, node: BaseNode402, condition: Callable[[], object]) -> None:
    for _ in range(5000):
        node.check_statusword()
        if condition():
            return
    pytest.fail(f"statusword {node.statusword:#06x} at {nodes.bench.clock.now_us} us")


def test_it_walks_the_state_machine_up_and_down(node: BaseNode402) -> None:
    for state in (
        "READY TO SWITCH ON",
        "SWITCHED ON",
        "OPERATION ENABLED",
        "SWITCHED ON",
        "READY TO SWITCH ON",
        "SWITCH ON DISABLED",
        "OPERATION ENABLED",
        "QUICK STOP ACTIVE",
        "SWITCH ON DISABLED",
    ):
        node.sdo[0x605A].raw = 6
        node.state = state
        assert node.state == state


def test_it_resets_a_fault(nodes: InProcessNodes, node: BaseNode402) -> None:
    node.state = "OPERATION ENABLED"
    nodes.bench.devices[0].fault(0x2310, 0x02)
    wait(nodes, node, node.is_faulted)
    assert node.emcy.active[0].code == 0x2310
    node.TIMEOUT_RESET_FAULT = 0.01
    node.reset_from_fault()
    assert node.state == "OPERATION ENABLED"
    assert node.emcy.active == []


@pytest.mark.parametrize("method", [1, 2, 17, 18, 33, 34, 35, 37])
def test_it_homes_by_every_method(node: BaseNode402, method: int) -> None:
    node.sdo[0x6099][1].raw = counts(100)
    node.sdo[0x6098].raw = method
    assert node.homing(timeout=60)
    assert node.is_homed()


def test_it_moves_in_profile_position(nodes: InProcessNodes, node: BaseNode402) -> None:
    node.op_mode = "PROFILED POSITION"
    node.state = "OPERATION ENABLED"
    node.sdo[0x6081].raw = counts(100)
    node.sdo[0x607A].raw = counts(8)
    node.controlword = 0x1F
    node.controlword = 0x0F
    wait(nodes, node, lambda: node.statusword & 0x400)
    assert node.sdo[0x6064].raw == pytest.approx(counts(8), abs=105)


def test_it_moves_in_the_cyclic_modes(nodes: InProcessNodes, node: BaseNode402) -> None:
    node.op_mode = "CYCLIC SYNCHRONOUS POSITION"
    node.state = "OPERATION ENABLED"
    for k in range(1, 400):
        node.sdo[0x607A].raw = counts(0.01 * k)
    wait(nodes, node, lambda: abs(node.sdo[0x6064].raw - counts(3.99)) < 50)
    node.op_mode = "CYCLIC SYNCHRONOUS VELOCITY"
    node.sdo[0x60FF].raw = counts(20)
    wait(nodes, node, lambda: abs(node.sdo[0x606C].raw - counts(20)) < counts(0.1))
    node.op_mode = "CYCLIC SYNCHRONOUS TORQUE"
    before = node.sdo[0x606C].raw
    node.sdo[0x6071].raw = 100
    wait(nodes, node, lambda: node.sdo[0x606C].raw > before + counts(10))


def test_it_is_refused_a_mode_the_drive_does_not_have(node: BaseNode402) -> None:
    with pytest.raises(TypeError, match="not suppported"):
        node.op_mode = "VELOCITY"
