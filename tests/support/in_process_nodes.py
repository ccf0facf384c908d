"""Master and simulated nodes in one process; every frame is delivered before `send` returns.

Nothing waits and nothing runs in a thread, so canopen's own master (SDO client, BaseNode402) can be the
counterpart in lockstep.
"""

import struct
from collections.abc import Callable
from functools import cache
from pathlib import Path

import can
import canopen

from hil_sim.config import load_plant
from hil_sim.runner.bench import SimulatedMachine
from hil_sim.runner.pacing import Lockstep

SUPPORT = Path(__file__).parent
EDS = SUPPORT.parents[1] / "eds"
IDEAL_AXIS = SUPPORT / "ideal_axis.toml"

COUNTS_PER_MM = 1048576 / 10.0
DRIVE, SCALE = 1, 11
STATE_BITS = {
    "not ready": (0x4F, 0x00),
    "switch on disabled": (0x4F, 0x40),
    "ready": (0x6F, 0x21),
    "switched on": (0x6F, 0x23),
    "enabled": (0x6F, 0x27),
    "quick stop": (0x6F, 0x07),
    "fault reaction": (0x4F, 0x0F),
    "fault": (0x4F, 0x08),
}
SHUTDOWN, SWITCH_ON, ENABLE, QUICK_STOP, FAULT_RESET = 0x06, 0x07, 0x0F, 0x02, 0x80
FORMATS = {2: "b", 3: "h", 4: "i", 5: "B", 6: "H", 7: "I"}


@cache
def dictionary_of(name: str, node_id: int) -> canopen.ObjectDictionary:
    """The library's dictionary of a node, which a master only reads; each reading of the file takes 50 ms."""
    return canopen.import_od(str(EDS / name), node_id)


class InProcessNodes:
    """`frames` logs what the nodes send, as (can_id, data)."""

    channel_info = "in process"

    def __init__(
        self, plant_file: Path = IDEAL_AXIS, state_directory: Path | None = None, drive_tick_ms: int = 1
    ) -> None:
        self.frames: list[tuple[int, bytes]] = []
        self.network = canopen.Network(bus=self)
        config = load_plant(plant_file).model_copy(update={"drive_tick_ms": drive_tick_ms})
        self.bench = SimulatedMachine(config, self._from_nodes, state_directory)
        Lockstep(self.bench)
        self.sync_on_every_frame = False
        self.bench.start()

    def send(self, message: can.Message, timeout: float | None = None) -> None:
        """The master's bus: frames of the master arrive at once."""
        del timeout
        if message.is_remote_frame:
            self.bench.frames.handle_remote(message.arbitration_id)
            return
        self.bench.handle(message.arbitration_id, bytes(message.data))
        if self.sync_on_every_frame:
            self.bench.handle(0x80, b"")

    def put(self, can_id: int, data: bytes = b"") -> None:
        """Send a raw frame to the nodes."""
        self.bench.handle(can_id, data)

    def ask(self, can_id: int) -> None:
        """Send a remote frame to the nodes."""
        self.bench.frames.handle_remote(can_id)

    def _from_nodes(self, can_id: int, data: bytes) -> None:
        self.frames.append((can_id, bytes(data)))
        self.network.notify(can_id, bytearray(data), self.bench.clock.now_us * 1e-6)

    def sync(self, count: int = 1) -> None:
        """Run `count` cycles."""
        for _ in range(count):
            self.put(0x80)

    def take(self, can_id: int) -> list[bytes]:
        """Frames with an identifier since the last call; clears the log."""
        found = [data for identifier, data in self.frames if identifier == can_id]
        self.frames.clear()
        return found

    def remote(self, node_id: int, kind: type = canopen.RemoteNode) -> canopen.RemoteNode:
        """The master's view of a node."""
        name = "servo_drive.eds" if node_id < 10 else "linear_scale.eds"
        node = kind(node_id, dictionary_of(name, node_id))
        self.network.add_node(node)
        return node

    def operational(self) -> None:
        """NMT start of all nodes."""
        self.put(0x000, bytes((1, 0)))


class SdoDrive:
    """Drive 1 of the nodes, operated by SDO in plain numbers."""

    def __init__(self, nodes: InProcessNodes) -> None:
        self.nodes = nodes
        self.node = nodes.remote(DRIVE)
        self.device = next(device for device in nodes.bench.devices if device.slave.node_id == DRIVE)

    def get(self, index: int, subindex: int | None = None) -> int:
        """Read an object."""
        entry = self.node.sdo[index]
        return entry.raw if subindex is None else entry[subindex].raw

    def set(self, index: int, value: int, subindex: int | None = None) -> None:
        """Write an object."""
        entry = self.node.sdo[index]
        if subindex is None:
            entry.raw = value
        else:
            entry[subindex].raw = value

    def control(self, word: int) -> None:
        """Write the controlword."""
        self.set(0x6040, word)

    @property
    def statusword(self) -> int:
        """The statusword."""
        return self.get(0x6041)

    @property
    def state(self) -> str:
        """Name of the state shown by the statusword."""
        word = self.statusword
        matches = [name for name, (mask, value) in STATE_BITS.items() if word & mask == value]
        assert len(matches) == 1, f"statusword 0x{word:04X}"
        return matches[0]

    def enable(self, mode: int) -> None:
        """Set a mode of operation and enable operation."""
        self.set(0x6060, mode)
        for word in (SHUTDOWN, SWITCH_ON, ENABLE):
            self.control(word)
        assert self.state == "enabled"

    @property
    def position_mm(self) -> float:
        """Actual position, user counts as millimetres."""
        return self.get(0x6064) / COUNTS_PER_MM

    @property
    def true_position_mm(self) -> float:
        """True motor position, from the machine's zero."""
        return float(self.nodes.bench.plant.state["motor_position_m"][0]) * 1e3

    @property
    def true_velocity_mm_s(self) -> float:
        """True motor velocity."""
        return float(self.nodes.bench.plant.state["motor_velocity_m_s"][0]) * 1e3

    def sync_until(self, condition: Callable[[], object], limit: int) -> int:
        """Run cycles until `condition()` holds; return how many. Fails after `limit`."""
        for count in range(limit):
            if condition():
                return count
            self.nodes.sync()
        raise AssertionError(f"did not come true in {limit} cycles")


def counts(millimetres: float) -> int:
    """Millimetres (or mm/s, mm/s^2) in counts."""
    return round(millimetres * COUNTS_PER_MM)


def pack(formats: str, *values: int) -> bytes:
    """Little-endian bytes of a PDO."""
    return struct.pack("<" + formats, *values)
