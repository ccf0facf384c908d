"""Runs in a copy of the tree that has the field; see docs/development.md."""

import json
from pathlib import Path
from typing import Any

import pytest
from cia306 import findings
from controller_node_bench import NODE_ID, OWN_EDS, ControllerNodeBench
from fake_command_handler import FakeCommandHandler
from learning_stand import LearningStand

from servo_ctrl.canopen.remote_controller import RemoteController
from servo_ctrl.canopen.stack import Network, load_eds
from servo_ctrl.commands.axis_status import AxisStatus
from servo_ctrl.commands.local_codec import from_plain, to_plain
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.status_fields import axis_rows
from servo_ctrl.commands.tables import files
from servo_ctrl.telemetry.mqtt.payloads import state_payload

ROOT = Path.cwd()


@pytest.fixture(scope="module", autouse=True)
def tables() -> None:
    """What `python -m servo_ctrl.commands.tables` writes."""
    for path, text in files(ROOT).items():
        path.write_text(text, encoding="utf-8")


@pytest.fixture
def handler() -> Any:
    handler: Any = FakeCommandHandler()
    handler.set_axis(1, reversals_cut_off=7)
    return handler


def cut_off(axes: tuple[AxisStatus, ...]) -> list[Any]:
    return [getattr(axis, "reversals_cut_off") for axis in axes]  # noqa: B009  # the copy alone has it


def test_the_daemon_counts_it(tmp_path: Path) -> None:
    stand = LearningStand(ROOT / "machines" / "xy_table" / "controller.toml", tmp_path)
    stand.services.learning.production.monitor.cut_off[1] = 3
    assert cut_off(stand.status.axes) == [0, 3]


def test_sdo_reads_it_and_the_command_line_gets_it_back() -> None:
    assert findings(OWN_EDS) == []
    bench = ControllerNodeBench()
    bench.handler.set_axis(1, reversals_cut_off=7)
    network = Network(bench.put)
    bench.client.subscribe(0x580 + NODE_ID, network.notify)
    bench.node.boot_up()
    assert bench.remote.sdo[0x2122][11].raw == 7
    remote = RemoteController(network, NODE_ID, load_eds(OWN_EDS, NODE_ID), ("x", "y"))
    assert cut_off(remote.status().axes) == [0, 7]


def test_mqtt_the_local_socket_and_the_tables_have_it(handler: Any) -> None:
    status = handler.status()
    assert json.loads(state_payload(status, 0))["axis"]["y"]["reversals_cut_off"] == 7
    plain = json.loads(json.dumps(to_plain(status)))
    assert cut_off(from_plain(MachineStatus, plain).axes) == [0, 7]
    assert dict(axis_rows(status.axes))["cut off"] == ["0", "7"]
    assert "| Reversals cut off | u32 |" in (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
