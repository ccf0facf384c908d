"""A change published to a real broker, beside the controller's own topics."""

import asyncio
from pathlib import Path
from typing import Any

import pytest
from machine_files import XY_TABLE, text_of, write_controller
from mosquitto import Mosquitto, needs_mosquitto

from reconcile.watch.history import EMPTY, WatchHistory
from reconcile.watch.publisher import ChangePublisher, PublishResult
from servo_ctrl.config.load import load_machine

pytestmark = needs_mosquitto

CHANGE = {
    "id": "x-1",
    "axis": "x",
    "alarm": {"recording": "run-013", "time_s": 1_800_046_800.0},
    "began": {"recording": "run-012", "time_s": 1_800_043_200.0, "interval95": ["run-011", "run-012"]},
    "form": "step",
    "sentence": "axis x, since run-012: Coulomb friction fell from 9.88 N to 6.88 N",
    "moved": [
        {
            "sense": "force",
            "indicator": "coulomb_n",
            "unit": "N",
            "before": 9.88,
            "after": 6.88,
            "after_ci95": [6.6, 7.1],
            "t": -29.0,
        }
    ],
    "where": [
        {
            "sensor": "force",
            "coordinate": "direction",
            "unit": "",
            "range": [0.0, 0.0],
            "label": "",
            "share": 0.97,
        }
    ],
    "named": {"verdict": "parameters", "findings": []},
    "published": False,
}


def history() -> WatchHistory:
    return WatchHistory({**EMPTY, "changes": [dict(CHANGE)]})


async def published_message(broker: Mosquitto, publisher: ChangePublisher, state: WatchHistory) -> Any:
    """Publish the changes; return the message that a later subscriber receives."""
    assert await asyncio.to_thread(publisher.publish, state) == PublishResult(published=True)
    async with broker.listener("#") as late:
        return await late.until("/change")


async def test_a_change_is_retained_in_the_machines_tree(tmp_path: Path) -> None:
    async with Mosquitto(tmp_path) as broker:
        state = history()
        publisher = ChangePublisher(f"127.0.0.1:{broker.port}", None, "table 1")
        message = await published_message(broker, publisher, state)
        assert message.topic == "servo_ctrl/table_1/axis/x/change"
        assert (message.retained, message.qos) == (True, 1)
        assert message.content["began"]["recording"] == "run-012"
        assert message.content["time"] == "2027-01-15T21:00:00.000+00:00"
        assert message.content["moved"][0]["after"] == 6.88
        assert message.content["verdict"] == "parameters"
        assert state.document["changes"][0]["published"]
        assert await asyncio.to_thread(publisher.publish, state) == PublishResult()


async def test_an_unreachable_broker_is_reported_once_and_tried_again(tmp_path: Path) -> None:
    broker = Mosquitto(tmp_path)
    state = history()
    publisher = ChangePublisher(f"127.0.0.1:{broker.port}", None, "table")
    result = await asyncio.to_thread(publisher.publish, state)
    assert "tried again" in result.problem
    assert await asyncio.to_thread(publisher.publish, state) == PublishResult()
    assert not state.document["changes"][0]["published"]
    async with broker:
        message = await published_message(broker, publisher, state)
        assert message.content["id"] == "x-1"


async def test_broker_address_comes_from_the_machine_file_but_not_the_client_id(tmp_path: Path) -> None:
    async with Mosquitto(tmp_path) as broker:
        section = (
            f'[mqtt]\nhost = "127.0.0.1"\nport = {broker.port}\nprefix = "works/hall"\nclient_id = "daemon"\n'
        )
        machine = machine_with(tmp_path / "machine", section)
        message = await published_message(broker, ChangePublisher(None, machine, ""), history())
        assert message.topic == f"works/hall/{load_machine(machine).machine.name}/axis/x/change"
        log = (tmp_path / "mosquitto.log").read_text(encoding="utf-8")
        assert "as reconcile-" in log
        assert "as daemon" not in log


def machine_with(folder: Path, section: str) -> Path:
    """Write the X-Y table with one more section."""
    write_controller(folder, f"{text_of(XY_TABLE / 'controller.toml')}\n{section}")
    return folder


@pytest.mark.parametrize("address", ["", "a b", "host:port"])
def test_an_invalid_address_is_refused(address: str) -> None:
    with pytest.raises(ValueError, match=r"HOST|host"):
        ChangePublisher(address, None, "table")
