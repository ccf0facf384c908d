"""One message of each kind that is published over MQTT, made by the product's own functions."""

import re
from datetime import UTC, datetime
from pathlib import Path

from fake_command_handler import LEARNED, OUTLOOK, REVERSAL, SCREW, FakeCommandHandler

from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.telemetry.mqtt import payloads
from servo_ctrl.telemetry.mqtt.topics import Topics

WATCH = Path(__file__).parents[2] / "docs" / "watch.md"
TOPICS = Topics("servo_ctrl", "xy_table")


def messages() -> dict[str, bytes]:
    """Return messages by topic; that of `reconcile watch` is its documented example."""
    handler = FakeCommandHandler()
    handler.set_learning("x", LearningState.RUNNING, OUTLOOK)
    handler.set_axis(
        0, version=3, learned_at="2026-11-20T09:00:00+00:00", learned=LEARNED, last=REVERSAL, screw=SCREW
    )
    status = handler.status()
    (change,) = re.findall(r"```json\n(.*?)```", WATCH.read_text(encoding="utf-8"), re.DOTALL)
    return {
        TOPICS.online: payloads.ONLINE,
        TOPICS.state: payloads.state_payload(status, 0),
        TOPICS.reversal("x"): payloads.reversal_payload(REVERSAL, datetime.now(UTC)),
        TOPICS.learned("x"): payloads.learned_payload(1, status.axes[0]),
        TOPICS.change("x"): change.encode(),
    }
