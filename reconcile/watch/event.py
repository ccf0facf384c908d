"""Publishes changes over MQTT, retained, as `prefix/machine/axis/NAME/change` beside the controller's topics.

The controller need not run. A broker that does not answer is reported, and tried again with the next
recordings.
"""

import asyncio
import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from reconcile.watch.memory import Memory
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.mqtt_model import MqttConfig
from servo_ctrl.telemetry.mqtt.client import Broker, BrokerError
from servo_ctrl.telemetry.mqtt.topics import Topics, level

MAX_FINDINGS = 5
"""Most findings in the payload; watch.json has all."""


class Events:
    """The topics of one machine. Raises ServoCtrlError: machine or credentials; ValueError: the address."""

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

    def publish(self, memory: Memory) -> str | None:
        """Publish new changes; return None if done, "" if there were none, else the reason of a failure.

        It returns the same reason only once. Every wait is bounded.
        """
        waiting = [change for change in memory.document["changes"] if not change["published"]]
        if not waiting:
            return ""
        try:
            asyncio.run(self._publish(waiting))
        except BrokerError as error:
            reported, self._problem = self._problem, str(error)
            if reported == str(error):
                return ""
            return f"MQTT {self._broker.address}: not published, tried again: {error}"
        self._problem = ""
        return None

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
            {key: one[key] for key in ("sense", "indicator", "unit", "before", "after", "after_ci95")}
            for one in change["moved"]
        ],
        "where": [
            {key: one[key] for key in ("sensor", "coordinate", "unit", "range", "label", "share")}
            for one in change["where"]
        ],
        "verdict": named.get("verdict"),
        "findings": [
            {key: one[key] for key in ("effect", "confidence", "equivalent", "explanation")}
            for one in named.get("findings", [])[:MAX_FINDINGS]
        ],
    }
    return json.dumps(content, allow_nan=False, separators=(",", ":")).encode("ascii")


def _utc(time_s: float) -> str:
    return datetime.fromtimestamp(time_s, UTC).isoformat(timespec="milliseconds")
