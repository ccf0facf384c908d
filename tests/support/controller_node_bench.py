"""The controller's own node by function calls: frames as plain bytes, or through canopen's client."""

import functools
from pathlib import Path
from typing import Any, Self

import canopen
from fake_command_handler import FakeCommandHandler

from servo_ctrl.canopen.node import ControllerNode
from servo_ctrl.canopen.stack import Network
from servo_ctrl.config.load import load_machine

REPOSITORY = Path(__file__).parents[2]
OWN_EDS = REPOSITORY / "eds" / "servo_ctrl.eds"
NODE_ID = 127
STATUS_ID = 0x180 + NODE_ID


@functools.cache
def entries_of_the_eds() -> canopen.ObjectDictionary:
    """Return the object dictionary as canopen reads it; it is shared, and nothing writes into it."""
    return canopen.import_od(str(OWN_EDS), NODE_ID)


def abort(index_and_sub: str, code: int) -> list[str]:
    """Return what `ask` returns if the node aborts a transfer of this object (hex, as on the wire)."""
    return ["80" + index_and_sub + code.to_bytes(4, "little").hex()]


class ControllerNodeBench:
    """Node 127 of the X-Y table with a fake command handler; `frames` logs (identifier, data) sent."""

    def __init__(self, **stored: Any) -> None:
        self.frames: list[tuple[int, bytes]] = []
        self.clock_s = 0.0
        """Time of the node's clock; only a test advances it."""
        self.handler = FakeCommandHandler()
        self.network = Network(self._from_us)
        self.client = canopen.Network()
        self.client.send_message = self._to_us
        self.remote: Any = self.client.add_node(canopen.RemoteNode(NODE_ID, entries_of_the_eds()))
        self.node = ControllerNode(
            self.network,
            load_machine(REPOSITORY / "machines" / "xy_table"),
            self.handler,
            now_s=lambda: self.clock_s,
            **stored,
        )

    @classmethod
    def booted(cls) -> Self:
        """A bench whose node has announced itself."""
        bench = cls()
        bench.node.boot_up()
        return bench

    def put(self, can_id: int, payload: bytes) -> None:
        """Deliver a frame from the bus."""
        self.network.notify(can_id, bytearray(payload), 0.0)

    def ask(self, request: str) -> list[str]:
        """Send an SDO request given in hex (blanks ignored), return the answers likewise."""
        self.frames.clear()
        self.put(0x600 + NODE_ID, bytes.fromhex(request))
        return [data.hex() for can_id, data in self.frames if can_id == 0x580 + NODE_ID]

    def cycles(self, count: int, elapsed: int = 1) -> list[int]:
        """Run cycles; return the number of status PDOs sent in each."""
        sent = []
        for _ in range(count):
            before = len(self.status_pdos)
            self.node.count_cycles(elapsed)
            sent.append(len(self.status_pdos) - before)
        return sent

    @property
    def status_pdos(self) -> list[bytes]:
        """Payloads of the status PDOs sent so far."""
        return [data for can_id, data in self.frames if can_id == STATUS_ID]

    def _to_us(self, can_id: int, payload: bytes, remote: bool = False) -> None:
        assert not remote
        self.put(can_id, payload)

    def _from_us(self, can_id: int, payload: bytes) -> None:
        self.frames.append((can_id, payload))
        self.client.notify(can_id, bytearray(payload), 0.0)
