"""The X-Y table's machine, and its nodes as scripted canopen nodes on a bus in memory."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import can
import canopen
import pytest

from servo_ctrl.canopen.node_plan import NodePlan
from servo_ctrl.canopen.plan import plan_machine
from servo_ctrl.canopen.stack import Network
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig

REPOSITORY = Path(__file__).parents[3]


@pytest.fixture
def table() -> MachineConfig:
    return load_machine(REPOSITORY / "machines" / "xy_table")


@pytest.fixture
def plans(table: MachineConfig) -> tuple[NodePlan, ...]:
    return plan_machine(table)


class Bench:
    """A virtual bus: our network on one end, nodes of the canopen library on the other."""

    def __init__(self) -> None:
        self.sent: list[tuple[int, bytes]] = []
        self._ours = can.Bus(interface="virtual", channel=f"boot-{id(self)}")
        self._theirs = can.Bus(interface="virtual", channel=f"boot-{id(self)}")
        self.network = Network(self._send)
        self.far = canopen.Network(self._theirs)
        self._notifiers = [
            can.Notifier(
                self._ours, [lambda m: self.network.notify(m.arbitration_id, m.data, m.timestamp)], 0.02
            ),
            can.Notifier(self._theirs, self.far.listeners, 0.02),
        ]

    def add(self, plan: NodePlan, **values: int) -> Any:
        """A node as the plan expects it; `values` like x6076_00=640 replace what it answers."""
        node = self.far.create_node(plan.node_id, str(plan.eds.path))
        for wanted in plan.expectations:
            set_value(node, wanted.index, wanted.subindex, wanted.value)
        if plan.units is not None:
            set_value(node, 0x608F, 1, plan.units.counts_per_rev)
            set_value(node, 0x6092, 1, plan.units.counts_per_rev)
        for key, value in values.items():
            index, subindex = (int(part, 16) for part in key.removeprefix("x").split("_"))
            set_value(node, index, subindex, value)
        return node

    def close(self) -> None:
        for notifier in self._notifiers:
            notifier.stop(timeout=2.0)
        self._ours.shutdown()
        self._theirs.shutdown()

    def _send(self, can_id: int, payload: bytes) -> None:
        self.sent.append((can_id, payload))
        self._ours.send(can.Message(arbitration_id=can_id, data=payload, is_extended_id=False))


def set_value(node: Any, index: int, subindex: int, value: int) -> None:
    """What the node answers from now on."""
    entry = node.object_dictionary.get_variable(index, subindex)
    node.data_store.setdefault(index, {})[subindex] = entry.encode_raw(value)


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


@pytest.fixture
def value_setter() -> Callable[[Any, int, int, int], None]:
    return set_value
