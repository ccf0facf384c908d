"""What the suite and the controller ask of a drive is what canopen's BaseNode402, code of others, expects."""

import canopen
import pytest
from canopen.profiles.p402 import BaseNode402, State402
from in_process_nodes import DRIVE, EDS, InProcessNodes

from servo_ctrl.conformance import verdicts
from servo_ctrl.conformance.suite import examine
from servo_ctrl.cyclic import cia402

COMMANDS = {
    "DISABLE VOLTAGE": cia402.DISABLE_VOLTAGE,
    "READY TO SWITCH ON": cia402.SHUTDOWN,
    "SWITCHED ON": cia402.SWITCH_ON,
    "OPERATION ENABLED": cia402.ENABLE_OPERATION,
    "QUICK STOP ACTIVE": cia402.QUICK_STOP,
    "SWITCH ON DISABLED": cia402.FAULT_RESET,
}


def test_statuswords_and_controlwords_are_the_same() -> None:
    ours = {state.value.upper(): (mask, value) for mask, value, state in cia402.STATUS_PATTERNS}
    assert ours == State402.SW_MASK
    assert COMMANDS == State402.CW_COMMANDS_CODE


class Wire:
    """Nodes in this process, as the suite sees a bus."""

    def __init__(self, nodes: InProcessNodes) -> None:
        self._nodes = nodes
        self.send = nodes.put

    def receive(self, timeout_s: float) -> tuple[int, bytes] | None:
        """The next frame; a cycle passes where none has come."""
        for _ in range(60 if timeout_s else 1):
            if self._nodes.frames:
                return self._nodes.frames.pop(0)
            if timeout_s:
                self._nodes.bench.advance_cycle()
                self._nodes.bench.run_timers()
        return None


@pytest.fixture
def nodes() -> InProcessNodes:
    made = InProcessNodes()
    made.frames.clear()
    return made


def test_base_node_402_operates_the_node_that_passes_the_suite(nodes: InProcessNodes) -> None:
    """The suite leaves the node as it was: behind it the other master walks all states."""
    assert verdicts.failures(list(examine(Wire(nodes), DRIVE, EDS / "servo_drive.eds"))) == []
    nodes.sync_on_every_frame = True
    node: canopen.RemoteNode = nodes.remote(DRIVE, BaseNode402)
    node.nmt.state = "PRE-OPERATIONAL"
    node.sdo[0x1800][1].raw = 0xC0000181
    node.setup_402_state_machine()
    node.nmt.state = "OPERATIONAL"
    for state in ("READY TO SWITCH ON", "SWITCHED ON", "OPERATION ENABLED", "SWITCH ON DISABLED"):
        node.state = state
        assert node.state == state
