"""Our own node, asked by a client of the canopen library; and its EDS."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import canopen
import pytest
from cia306 import findings

from servo_ctrl.canopen.node import ControllerNode
from servo_ctrl.canopen.stack import Network

if TYPE_CHECKING:
    from servo_ctrl.config.model import MachineConfig

EDS = Path(__file__).parents[3] / "eds" / "servo_ctrl.eds"


class Desk:
    """A client and our node, joined frame by frame; `frames` is all that our node sent."""

    def __init__(self, machine: MachineConfig) -> None:
        self.frames: list[tuple[int, bytes]] = []
        self.status = (0, 0, 0)
        self.network = Network(self._from_us)
        self.client = canopen.Network()
        self.client.send_message = self._to_us
        self.remote: Any = self.client.add_node(127, str(EDS))
        self.node = ControllerNode(self.network, machine, lambda: self.status)

    def _to_us(self, can_id: int, payload: bytes, remote: bool = False) -> None:
        assert not remote
        self.network.notify(can_id, bytearray(payload), 0.0)

    def _from_us(self, can_id: int, payload: bytes) -> None:
        self.frames.append((can_id, payload))
        self.client.notify(can_id, bytearray(payload), 0.0)


@pytest.fixture
def desk(table: MachineConfig) -> Desk:
    return Desk(table)


def test_eds_is_clean_under_cia_306() -> None:
    assert findings(EDS) == []


def test_identity_is_that_of_the_eds(desk: Desk) -> None:
    asked = [desk.remote.sdo[0x1000].raw, *(desk.remote.sdo[0x1018][sub].raw for sub in (1, 2, 3))]
    assert asked == [0, 0, 0x53435452, 0x00010000]
    assert desk.remote.sdo[0x1008].raw == "servo_ctrl"
    assert (desk.remote.sdo[0x1014].raw, desk.remote.sdo[0x1200][1].raw) == (0x80 + 127, 0x600 + 127)


def test_boot_up_then_heartbeats_with_the_nmt_state(desk: Desk) -> None:
    desk.node.boot_up()
    desk.node.send_heartbeat()
    desk.node.operational(running=True)
    desk.node.send_heartbeat()
    assert desk.frames == [(0x77F, b"\x00"), (0x77F, b"\x7f"), (0x77F, b"\x05")]


def test_heartbeat_is_counted_in_cycles(desk: Desk) -> None:
    desk.node.boot_up()
    desk.frames.clear()
    for _ in range(1000):
        desk.node.count_cycles(1)
    assert len(desk.frames) == 10


def test_missed_cycles_count_for_the_heartbeat_too(desk: Desk) -> None:
    desk.node.boot_up()
    desk.frames.clear()
    for _ in range(100):
        desk.node.count_cycles(10)
    assert len(desk.frames) == 10


def test_client_changes_the_heartbeat_by_1017(desk: Desk) -> None:
    desk.node.boot_up()
    desk.remote.sdo[0x1017].raw = 20
    desk.frames.clear()
    for _ in range(100):
        desk.node.count_cycles(1)
    assert len([frame for frame in desk.frames if frame[0] == 0x77F]) == 5
    desk.remote.sdo[0x1017].raw = 0
    desk.frames.clear()
    for _ in range(2000):
        desk.node.count_cycles(1)
    assert [frame for frame in desk.frames if frame[0] == 0x77F] == []


def test_state_and_counters_are_live(desk: Desk) -> None:
    desk.status = (3, 70_000, 12)
    assert [desk.remote.sdo[index].raw for index in (0x2000, 0x2002, 0x2003)] == [3, 70_000, 12]


def test_errors_reach_register_history_text_and_emcy(desk: Desk) -> None:
    desk.node.report_error(0x8130, "axis.x.drive (node 1): no heartbeat")
    desk.node.report_error(0x8611, "axis x: following error")
    assert desk.remote.sdo[0x1001].raw == 1
    history = desk.remote.sdo[0x1003]
    assert [history[sub].raw for sub in range(4)] == [2, 0x8611, 0x8130, 0]
    assert desk.remote.sdo[0x2001].raw == "axis x: following error"
    emcy = [payload for can_id, payload in desk.frames if can_id == 0x80 + 127]
    assert emcy == [bytes.fromhex("3081 01 0000000000"), bytes.fromhex("1186 01 0000000000")]


def test_consumed_heartbeats_are_listed(desk: Desk) -> None:
    consumers = desk.remote.sdo[0x1016]
    assert [consumers[sub].raw for sub in (1, 2, 3, 4, 5)] == [
        node << 16 | 300 for node in (1, 2, 11, 12)
    ] + [0]


def test_clients_may_not_write_the_state(desk: Desk) -> None:
    with pytest.raises(canopen.SdoAbortedError, match="read only"):
        desk.remote.sdo[0x2000].raw = 1
