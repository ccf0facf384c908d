"""Publishes changes over MQTT, retained, as `prefix/machine/axis/NAME/change` beside the controller's topics.

The controller need not run. A broker that does not answer is reported, and tried again with the next
recordings.
"""

import asyncio
import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from reconcile.watch.history import WatchHistory
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.mqtt_model import MqttConfig
from servo_ctrl.telemetry.mqtt.client import Broker, BrokerError
from servo_ctrl.telemetry.mqtt.topics import Topics, level

MAX_FINDINGS = 5
"""Most findings in the payload; watch.json has all."""


class PublishResult(NamedTuple):
    """Whether changes were published."""

    published: bool = False
    problem: str = ""
    """Reason of a failure, the first time that it occurs; empty without one."""


class ChangePublisher:
    """Publishes changes of one machine.

    Raises ServoCtrlError: machine or credentials cannot be used; ValueError: nor can the address.
    """

    def __init__(self, address: str | None, machine_dir: Path | None, name: str) -> None:
        config = MqttConfig()
        if machine_dir is not None:
            machine = load_machine(machine_dir)
            name = machine.machine.name
            # a broker disconnects the controller when another client uses its client_id
            config = (machine.mqtt or config).model_copy(update={"client_id": None})
        if address is not None:
            config = config.at(address)
        self._topics = Topics(config.prefix, name)
        self._broker = Broker(config, f"reconcile-{level(name)}")
        self._problem = ""

    def publish(self, history: WatchHistory) -> PublishResult:
        """Publish the changes that are not yet published, and mark them. Every wait is bounded."""
        unpublished = [change for change in history.document["changes"] if not change["published"]]
        if not unpublished:
            return PublishResult()
        try:
            asyncio.run(self._publish(unpublished))
        except BrokerError as error:
            reported, self._problem = self._problem, str(error)
            if reported == str(error):
                return PublishResult()
            problem = f"MQTT {self._broker.address}: not published, tried again: {error}"
            return PublishResult(problem=problem)
        self._problem = ""
        return PublishResult(published=True)

    async def _publish(self, changes: list[dict[str, Any]]) -> None:
        async with self._broker.connection() as connection:
            for change in changes:
                topic = self._topics.change(change["axis"])
                await connection.publish(topic, payload(change), retain=True)
                change["published"] = True


def payload(change: dict[str, Any]) -> bytes:
    """Return the message of a change as JSON; quantities are SI."""
    began, named = change["began"], change["named"] or {}
    content = {
        "time": _utc(change["alarm"]["time_s"]),
        "id": change["id"],
        "recording": change["alarm"]["recording"],
        "began": {
            "recording": began["recording"],
            "time": _utc(began["time_s"]),
            "interval95": began["interval95"],
        },
        "form": change["form"],
        "sentence": change["sentence"],
        "moved": [
            {key: moved[key] for key in ("sense", "indicator", "unit", "before", "after", "after_ci95")}
            for moved in change["moved"]
        ],
        "where": [
            {key: located[key] for key in ("sensor", "coordinate", "unit", "range", "label", "share")}
            for located in change["where"]
        ],
        "verdict": named.get("verdict"),
        "findings": [
            {key: finding[key] for key in ("effect", "confidence", "equivalent", "explanation")}
            for finding in named.get("findings", [])[:MAX_FINDINGS]
        ],
    }
    return json.dumps(content, allow_nan=False, separators=(",", ":")).encode("ascii")


def _utc(time_s: float) -> str:
    return datetime.fromtimestamp(time_s, UTC).isoformat(timespec="milliseconds")
