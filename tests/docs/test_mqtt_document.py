"""docs/mqtt.md shows the topics and messages as they are."""

import json
import re
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from fake_command_handler import LEARNED, REVERSAL, SCREW, FakeCommandHandler

from servo_ctrl.commands.command import Command, Refusal, Right
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.machine_status import ContourStatus
from servo_ctrl.commands.stage import Stage
from servo_ctrl.telemetry.mqtt import payloads
from servo_ctrl.telemetry.mqtt.commands import SETTING_OF, MqttCommands
from servo_ctrl.telemetry.mqtt.stream import RowStream
from servo_ctrl.telemetry.mqtt.topics import Topics

DEPLOY = Path(__file__).parents[2] / "deploy"
DOCUMENT = (Path(__file__).parents[2] / "docs" / "mqtt.md").read_text(encoding="utf-8")
EXAMPLES = [json.loads(block) for block in re.findall(r"```json\n(.*?)```", DOCUMENT, re.DOTALL)]


def shape(value: Any) -> Any:
    """Keys and kinds of values, without the values; of lists the first element."""
    if isinstance(value, dict):
        return {key: shape(inner) for key, inner in value.items()}
    return [shape(value[0])] if isinstance(value, list) else type(value)


def test_the_examples_have_the_shape_of_the_messages() -> None:
    handler = FakeCommandHandler(("x",))
    handler.set_learning("x", LearningState.RUNNING)
    handler.set_axis(
        0, version=3, learned_at="2026-11-20T09:00:00+00:00", learned=LEARNED, last=REVERSAL, screw=SCREW
    )
    status = handler.status()._replace(contour=ContourStatus(("x", "y"), 1.25e-6))
    messages = [
        payloads.state_payload(status, 0),
        payloads.reversal_payload(REVERSAL, datetime.now(UTC)),
        payloads.due_payload(1, due=True),
        payloads.learned_payload(1, status.axes[0]),
        RowStream(("x",), 1e-3, 100.0).description(),
        payloads.ack_payload(1, "17", "wrong_state", "because"),
    ]
    assert [shape(example) for example in EXAMPLES] == [shape(json.loads(message)) for message in messages]


def test_every_topic_is_in_the_table() -> None:
    topics = Topics("servo_ctrl", "xy_table")
    every = {
        *(topics.online, topics.state, topics.command, *topics.command_of.values(), topics.ack),
        *(topics.stream, topics.stream_channels),
        *(topics.reversal("NAME"), topics.learning_due("NAME"), topics.learned("NAME")),
    }
    rows = re.findall(r"^\| `([a-zA-Z/_]+)` \| (?:in|out) \|", DOCUMENT, re.MULTILINE)
    assert {f"{topics.root}/{row}" for row in rows} == every


def test_every_name_that_a_message_can_have_is_explained() -> None:
    names = [
        *(member.name.lower() for kind in (Command, Refusal, Stage, LearningState) for member in kind),
        *SETTING_OF,
    ]
    names += ["malformed", "stale", "wrong_topic"]
    assert [name for name in names if f"`{name}`" not in DOCUMENT] == []


def test_the_commands_of_the_examples_are_accepted() -> None:
    sent = re.findall(r"-t servo_ctrl/xy_table/command/(\w+) -m '(.*)'", DOCUMENT)
    assert [topic for topic, _ in sent] == ["operate", "configure", "stop"]
    for topic, message in sent:
        answer = MqttCommands(FakeCommandHandler(), Right(topic)).answer(message.encode(), retained=False)
        assert answer.refusal == "none"


def test_the_access_list_is_the_one_of_the_table() -> None:
    rights = (DEPLOY / "mosquitto.acl").read_text(encoding="utf-8")
    table = re.findall(
        r"^\| `(operator|engineer|display|reconcile)` \| .* \| (.*) \|$", DOCUMENT, re.MULTILINE
    )
    assert len(table) == 4
    for user, written in table:
        (block,) = re.findall(rf"^user {user}\n((?:topic .*\n)+)", rights, re.MULTILINE)
        allowed = set(re.findall(r"^topic write servo_ctrl/xy_table/(\S+)$", block, re.MULTILINE))
        assert allowed == {name.replace("NAME", "+") for name in re.findall(r"`([^`]+)`", written)}
