"""A real broker decides by certificates and its access list who may move the machine and who may set it."""

import gc
import json
from pathlib import Path

import pytest
from broker_certificates import DEPLOY, USERS, broker_with, keys_of, login, make_certificates, needs_openssl
from fake_command_handler import FakeCommandHandler
from mosquitto import Listener, Mosquitto, needs_mosquitto
from mqtt_bench import COMMAND, ROOT, link_to, running, until

from servo_ctrl.commands.command import Command, CommandRequest, Right
from servo_ctrl.commands.local_messages import right_for
from servo_ctrl.hmi.shell import open_page as page
from servo_ctrl.telemetry.mqtt.commands import MqttCommands
from servo_ctrl.telemetry.mqtt.topics import Topics

START, CHANGE, STOP = (
    {"command": "start_learning"},
    {"setting": "adaptation", "value": True},
    {"command": "quick_stop"},
)


@pytest.fixture
def handler() -> FakeCommandHandler:
    return FakeCommandHandler()


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_certificates(tmp_path_factory.mktemp("certificates"), *USERS)


def asked(handler: FakeCommandHandler, right: Right | None, content: dict[str, object]) -> str:
    message = json.dumps({"id": "a", **content}).encode()
    return MqttCommands(handler, right).answer(message, retained=False).refusal


@pytest.mark.parametrize("right", Right)
@pytest.mark.parametrize("command", Command)
def test_a_topic_takes_the_commands_of_its_right_and_a_stop(right: Right, command: Command) -> None:
    handler = FakeCommandHandler()
    wanted = command is Command.QUICK_STOP or command.right is right
    refusal = asked(handler, right, {"command": command.name.lower()})
    assert (refusal, handler.requests) == (
        ("none", [CommandRequest(command)]) if wanted else ("wrong_topic", [])
    )


def test_settings_are_for_one_topic_and_the_plain_one_takes_everything() -> None:
    refusals = {right: asked(FakeCommandHandler(), right, CHANGE) for right in (*Right, None)}
    assert refusals == {
        Right.STOP: "wrong_topic",
        Right.OPERATE: "wrong_topic",
        Right.CONFIGURE: "none",
        None: "none",
    }
    assert all(
        asked(FakeCommandHandler(), None, {"command": command.name.lower()}) == "none" for command in Command
    )


def test_an_id_of_one_topic_is_none_of_another() -> None:
    handler = FakeCommandHandler()
    desks = [MqttCommands(handler, right) for right in (Right.OPERATE, Right.CONFIGURE)]
    for each, content in zip(desks, ({"command": "home"}, CHANGE), strict=True):
        assert each.answer(json.dumps({"id": "1", **content}).encode(), retained=False).refusal == "none"
    assert (len(handler.requests), len(handler.changes)) == (1, 1)


def test_the_page_and_the_topics_agree_on_what_needs_which_right() -> None:
    role_of = {Right.STOP: "view", Right.OPERATE: "operate", Right.CONFIGURE: "configure"}
    for command in Command:
        needed = right_for("command", command.name.lower())
        assert page.ROLE_OF[needed].label == role_of[command.right]
    assert page.ROLE_OF[right_for("setting")].label == role_of[Right.CONFIGURE]
    assert page.ROLE_OF[right_for("command", "fly")].label == "operate"
    assert Right.CONFIGURE.permits(Right.STOP)


def test_requests_are_logged_by_topic_not_by_a_name_from_the_payload() -> None:
    notes: list[str] = []
    handler = MqttCommands(FakeCommandHandler(), Right.OPERATE, notes.append)
    for number, content in enumerate((START, CHANGE, {"command": "\x1b[2J gone", "axis": "<b>"})):
        handler.answer(json.dumps({"id": str(number), **content}).encode(), retained=False)
    assert notes == [
        "MQTT command/operate: start_learning",
        "MQTT command/operate: adaptation, refused: wrong_topic",
        "MQTT command/operate: an unknown request, refused: unknown",
    ]


async def answers(broker: Mosquitto, listener: Listener, certificates: Path, user: str) -> dict[str, str]:
    """The answers to a user's start, setting and stop on each topic, as far as the broker allows."""
    broker.login = login(certificates, user)
    topics = (COMMAND, *Topics("servo_ctrl", "xy_table").command_of.values())
    contents = enumerate((START, CHANGE, STOP))
    sent = {f"{user} {topic} {number}": content for number, content in contents for topic in topics}
    for request_id, content in sent.items():
        await broker.publish(request_id.split()[1], json.dumps({"id": request_id, **content}))
    broker.login = login(certificates, "watcher")  # whose request comes last
    await broker.publish(f"{ROOT}/command/stop", json.dumps({"id": f"{user} end", **STOP}))
    await listener.until("/command/ack", lambda message: message.content["id"] == f"{user} end")
    received = {message.content["id"]: message.content["refusal"] for message in listener.received}
    listener.received.clear()
    return {
        f"{request_id.split()[1].removeprefix(ROOT + '/')} {next(iter(sent[request_id].values()))}": refusal
        for request_id, refusal in received.items()
        if request_id in sent
    }


@needs_mosquitto
@needs_openssl
async def test_certificates_and_the_access_list_decide_who_may_what(
    tmp_path: Path, certificates: Path, handler: FakeCommandHandler
) -> None:
    broker = broker_with(certificates, tmp_path)
    broker.login = login(certificates, "watcher")
    async with broker:
        link = link_to(broker, handler, plain_command=False, **keys_of(certificates, "controller"))
        async with running(link), broker.listener(f"{ROOT}/command/ack") as listener:
            await until(lambda: not link.problem)
            stops = {"command/stop quick_stop": "none"}
            not_here = dict.fromkeys(
                ("command/stop start_learning", "command/stop adaptation"), "wrong_topic"
            )
            assert await answers(broker, listener, certificates, "display") == {}
            assert await answers(broker, listener, certificates, "operator") == stops | not_here | {
                "command/operate start_learning": "none",
                "command/operate adaptation": "wrong_topic",
                "command/operate quick_stop": "none",
            }
            assert await answers(broker, listener, certificates, "engineer") == stops | not_here | {
                "command/configure start_learning": "wrong_topic",
                "command/configure adaptation": "none",
                "command/configure quick_stop": "none",
            }
    assert handler.changes == [("adaptation", True)]
    assert {request.command for request in handler.requests} == {Command.START_LEARNING, Command.QUICK_STOP}


@needs_mosquitto
@needs_openssl
# Paho leaves the socket of a failed handshake unclosed.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
async def test_a_broker_that_requires_certificates_refuses_clients_without_one_of_its_authority(
    tmp_path: Path, certificates: Path, handler: FakeCommandHandler
) -> None:
    foreign = make_certificates(tmp_path / "foreign", "controller")
    broker = broker_with(certificates, tmp_path)
    broker.login = login(certificates, "watcher")
    without = {"tls": True, "ca_file": certificates / "ca.pem"}
    posing = keys_of(foreign, "controller") | {"ca_file": certificates / "ca.pem"}
    both = (without, posing)
    async with broker:
        strangers = [link_to(broker, handler, client_id=f"stranger-{n}", **k) for n, k in enumerate(both)]
        deceived = link_to(broker, handler, **keys_of(foreign, "controller"))
        async with running(strangers[0]), running(strangers[1]), running(deceived):
            await until(lambda: all("refuses our certificate" in one.problem for one in strangers))
            await until(lambda: "CERTIFICATE_VERIFY_FAILED" in deceived.problem)
        gc.collect()
        log = (tmp_path / "mosquitto.log").read_text()
    assert "as stranger" not in log  # no client came in
    assert "as servo_ctrl" not in log
    assert handler.requests == []


def test_the_plain_topic_has_no_writer_in_the_example() -> None:
    lines = (DEPLOY / "mosquitto.acl").read_text().splitlines()
    assert [line for line in lines if "write" in line and line.endswith("/command")] == []
