"""What an MQTT message may ask for, and how everything else is refused."""

import json
from typing import Any

import pytest
from fake_command_handler import FakeCommandHandler
from hypothesis import given
from hypothesis import strategies as st

from servo_ctrl.commands.command import COMMANDS, Command, CommandRequest, CommandResult, Refusal
from servo_ctrl.telemetry.mqtt.commands import IDS_KEPT, LENGTH_LIMIT, MqttAnswer, MqttCommands

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
)


def ask(content: dict[str, Any], handler: FakeCommandHandler | None = None) -> MqttAnswer:
    return MqttCommands(handler or FakeCommandHandler()).answer(json.dumps(content).encode(), retained=False)


@pytest.mark.parametrize("command", Command)
def test_every_command_is_understood(command: Command) -> None:
    handler = FakeCommandHandler()
    answer = ask({"id": "a", "command": command.name.lower(), "axis": "y"}, handler)
    assert answer == MqttAnswer("a", "none", "")
    assert handler.requests == [CommandRequest(command, "y")]


@pytest.mark.parametrize(
    ("name", "value", "setting", "inside"),
    [
        ("required_um", 3.5, "required_m", 3.5e-6),
        ("required_um", 4, "required_m", 4e-6),
        ("learner", "fast", "learner", "fast"),
        ("learner", "paper", "learner", "paper"),
        ("adaptation", True, "adaptation", True),
        ("adaptation", False, "adaptation", False),
    ],
)
def test_every_setting_arrives_in_si_units(name: str, value: object, setting: str, inside: float) -> None:
    handler = FakeCommandHandler()
    assert ask({"id": "a", "setting": name, "value": value}, handler).refusal == "none"
    assert handler.changes == [(setting, pytest.approx(inside))]


@pytest.mark.parametrize("refusal", [refusal for refusal in Refusal if refusal is not Refusal.NONE])
def test_a_refusal_is_answered_with_its_reason(refusal: Refusal) -> None:
    handler = FakeCommandHandler()
    handler.verdict = CommandResult(refusal, "because")
    assert ask({"id": "a", "command": "roll_back"}, handler) == MqttAnswer(
        "a", refusal.name.lower(), "because"
    )
    assert ask({"id": "a", "setting": "adaptation", "value": True}, handler).reason == "because"


@pytest.mark.parametrize(
    ("payload", "refusal", "reason"),
    [
        (b"", "malformed", "not JSON: Expecting value: line 1 column 1 (char 0)"),
        (b"[]", "malformed", "not a JSON object"),
        (b"\xff", "malformed", "not UTF-8 at byte 0"),
        (b"[" * LENGTH_LIMIT, "malformed", "not JSON: nested too deeply"),
        (b" " * (LENGTH_LIMIT + 1), "malformed", "4097 bytes, at most 4096 are read"),
        (b"{}", "malformed", "id: is missing"),
        (b'{"id": 7}', "malformed", "id: must be a text (got 7)"),
        (b'{"id": ""}', "malformed", "id: string must have at least 1 character (got '')"),
        (b'{"id": "a", "id": "b"}', "malformed", "a key appears twice"),
        (b'{"id": "a", "command": "abort_learning", "force": 1}', "malformed", "force: unknown key"),
        (b'{"id": "a", "command": ["fly"]}', "malformed", "command: must be a text"),
        (b'{"id": "a", "command": "START_LEARNING"}', "unknown", "command: no 'START_LEARNING', only"),
        (b'{"id": "a", "setting": "learner"}', "malformed", "value: is missing"),
        (b'{"id": "a", "setting": "gain", "value": 1}', "unknown", "setting: no 'gain', only required_um"),
        (
            b'{"id": "a", "setting": "learner", "value": "slow"}',
            "out_of_range",
            "'fast', 'paper', 'screw' or 'waveform'",
        ),
        (
            b'{"id": "a", "setting": "adaptation", "value": 1}',
            "out_of_range",
            "must be true or false (got 1)",
        ),
        (b'{"id": "a", "setting": "required_um", "value": true}', "out_of_range", "number (got True)"),
        (b'{"id": "a", "setting": "required_um", "value": NaN}', "out_of_range", "finite number"),
        (b'{"id": "a", "setting": "required_um", "value": 1e999}', "out_of_range", "finite number"),
        (b'{"id": "a", "setting": "required_um", "value": 1' + b"0" * 400 + b"}", "out_of_range", "number"),
    ],
)
def test_an_invalid_request_is_refused_with_the_reason(payload: bytes, refusal: str, reason: str) -> None:
    handler = FakeCommandHandler()
    answer = MqttCommands(handler).answer(payload, retained=False)
    assert answer.refusal == refusal
    assert reason in answer.reason
    assert not handler.requests
    assert not handler.changes


def test_a_bad_message_is_answered_under_its_id() -> None:
    assert ask({"id": "a", "command": 5}).request_id == "a"
    assert ask({"id": "a" * 65, "command": "roll_back"}).request_id is None


def test_a_retained_command_is_refused_and_its_id_not_used_up() -> None:
    handler = FakeCommandHandler()
    commands = MqttCommands(handler)
    payload = b'{"id": "a", "command": "start_learning"}'
    assert commands.answer(payload, retained=True).refusal == "stale"
    assert handler.requests == []
    assert commands.answer(payload, retained=False).refusal == "none"


def test_a_repeated_id_is_answered_again_and_not_executed_again() -> None:
    handler = FakeCommandHandler()
    commands = MqttCommands(handler)
    first = commands.answer(b'{"id": "a", "command": "start_learning"}', retained=False)
    handler.verdict = CommandResult(Refusal.WRONG_STATE, "it learns already")
    assert commands.answer(b'{"command": "start_learning", "id": "a"}', retained=False) == first
    other = commands.answer(b'{"id": "a", "command": "abort_learning"}', retained=False)
    assert other == MqttAnswer("a", "malformed", "id: was used for another message")
    assert handler.requests == [CommandRequest(Command.START_LEARNING)]


def test_a_repeated_id_gets_its_refusal_again() -> None:
    handler = FakeCommandHandler()
    handler.verdict = CommandResult(Refusal.WRONG_STATE, "the machine moves")
    commands = MqttCommands(handler)
    first = commands.answer(b'{"id": "a", "command": "start_learning"}', retained=False)
    handler.verdict = CommandResult()
    assert commands.answer(b'{"id": "a", "command": "start_learning"}', retained=False) == first
    assert len(handler.requests) == 1


def test_a_bounded_number_of_ids_is_remembered() -> None:
    handler = FakeCommandHandler()
    commands = MqttCommands(handler)
    for number in [*range(IDS_KEPT), 0, IDS_KEPT, 0]:
        commands.answer(f'{{"id": "{number}", "command": "roll_back"}}'.encode(), retained=False)
    assert len(handler.requests) == IDS_KEPT + 2


@given(st.binary(max_size=LENGTH_LIMIT + 10) | JSON.map(lambda value: json.dumps(value).encode()))
def test_random_messages_are_never_executed(payload: bytes) -> None:
    handler = FakeCommandHandler()
    answer = MqttCommands(handler).answer(payload, retained=False)
    assert answer.refusal == "malformed"
    assert 0 < len(answer.reason) < 300
    assert not handler.requests


@given(
    st.fixed_dictionaries(
        {"id": JSON, "command": JSON | st.sampled_from(sorted(COMMANDS))},
        optional={"axis": JSON, "setting": JSON | st.just("required_um"), "value": JSON, "other": JSON},
    )
)
def test_only_exact_commands_are_executed(content: dict[str, Any]) -> None:
    handler = FakeCommandHandler()
    answer = ask(content, handler)
    sound = (
        set(content) <= {"id", "command", "axis"}
        and isinstance(content["id"], str)
        and 1 <= len(content["id"]) <= 64
        and content["command"] in list(COMMANDS)
        and isinstance(content.get("axis", ""), str)
        and len(content.get("axis", "")) <= 64
    )
    assert (answer.refusal == "none") is sound
    assert len(handler.requests) == sound
