"""A broker that is absent, hangs, refuses, dies and returns: the link survives."""

import asyncio
import gc
import json
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fake_command_handler import LEARNED, REVERSAL, FakeCommandHandler
from mosquitto import LIMIT_S, Mosquitto, needs_mosquitto
from mqtt_bench import ALL, COMMAND, ROOT, link_to, running, until

from servo_ctrl.telemetry.mqtt import client
from servo_ctrl.telemetry.mqtt.service import REVERSALS_WAITING_MAX

pytestmark = needs_mosquitto
CONTROLLER = """
import asyncio, sys
from fake_command_handler import FakeCommandHandler
from servo_ctrl.config.mqtt_model import MqttConfig
from servo_ctrl.telemetry.mqtt.service import MqttLink

async def main():
    await MqttLink(MqttConfig(port=int(sys.argv[1])), "xy_table", FakeCommandHandler()).run()

asyncio.run(main())
"""
"""A process with nothing but a link."""


def certified(folder: Path) -> str:
    """A broker's own certificate for 127.0.0.1, and the configuration to use it."""
    subprocess.run(
        [
            *("openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes"),
            *("-keyout", folder / "key.pem", "-out", folder / "cert.pem", "-days", "2"),
            *("-subj", "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1"),
        ],
        check=True,
        capture_output=True,
    )
    return f"allow_anonymous true\ncertfile {folder / 'cert.pem'}\nkeyfile {folder / 'key.pem'}"


@pytest.fixture
def controller(broker: Mosquitto) -> Iterator[subprocess.Popen[bytes]]:
    made = subprocess.Popen(
        [sys.executable, "-c", CONTROLLER, str(broker.port)], cwd=Path(__file__).parents[2] / "support"
    )
    yield made
    made.kill()
    made.wait(LIMIT_S)


def passwords(folder: Path, *users: str) -> str:
    """Who may come in, with the password "right", and the configuration to ask for it."""
    file = folder / "passwords"
    file.touch()
    for user in users:
        subprocess.run(["mosquitto_passwd", "-b", file, user, "right"], check=True)
    return f"allow_anonymous false\npassword_file {file}"


async def test_the_will_of_a_killed_controller_publishes_offline(
    broker: Mosquitto, controller: subprocess.Popen[bytes]
) -> None:
    async with broker.listener(f"{ROOT}/online") as listener:
        await listener.until("/online", lambda message: message.payload == "online")
        controller.kill()
        await listener.until("/online", lambda message: message.payload == "offline")


async def test_a_wrong_password_is_reported_and_the_right_one_connects(
    tmp_path: Path, handler: FakeCommandHandler
) -> None:
    broker, own = Mosquitto(tmp_path, passwords(tmp_path, "table")), tmp_path / "own"
    broker.login = ["-u", "table", "-P", "right"]
    own.touch(0o600)
    own.write_text("wrong\n")
    async with broker:
        link = link_to(broker, handler, username="table", password_file=own)
        async with running(link):
            await until(lambda: "authorized" in link.problem)
        own.write_text("right\n")
        link = link_to(broker, handler, username="table", password_file=own)
        async with running(link), broker.listener(ALL) as listener:
            await listener.until("/state")


async def test_missing_rights_are_reported_and_block_only_their_topics(
    tmp_path: Path, handler: FakeCommandHandler, caplog: pytest.LogCaptureFixture
) -> None:
    rights = tmp_path / "rights"
    rights.write_text(f"topic read #\ntopic write mark/#\ntopic write {ROOT}/state\n")
    broker = Mosquitto(tmp_path, f"allow_anonymous true\nacl_file {rights}")
    async with broker, running(link_to(broker, handler)), broker.listener(ALL) as listener:
        await listener.until("/state")
        assert [message.topic for message in listener.received] == [f"{ROOT}/state"]
    assert caplog.text.count("refuses messages of servo_ctrl-xy_table: Not authorized") == 1


@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is not installed")
# Paho leaves the socket of a failed handshake unclosed.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
async def test_an_encrypted_connection_checks_the_broker(tmp_path: Path, handler: FakeCommandHandler) -> None:
    broker, certificate = Mosquitto(tmp_path, certified(tmp_path)), tmp_path / "cert.pem"
    broker.login = ["--cafile", str(certificate)]
    async with broker:
        link = link_to(broker, handler, tls=True, ca_file=certificate)
        async with running(link), broker.listener(ALL) as listener:
            await listener.until("/state")
        foreign = link_to(broker, handler, tls=True)
        async with running(foreign):
            await until(lambda: "CERTIFICATE_VERIFY_FAILED" in foreign.problem)
        gc.collect()


async def test_a_stop_publishes_offline(broker: Mosquitto, handler: FakeCommandHandler) -> None:
    async with broker.listener(f"{ROOT}/online") as listener:
        async with running(link_to(broker, handler)):
            await listener.until("/online", lambda message: message.payload == "online")
        await listener.until("/online", lambda message: message.payload == "offline")
    async with broker.listener(f"{ROOT}/online") as late:
        assert (await late.until("/online")).payload == "offline"


async def test_the_whole_state_is_published_again_after_reconnection(
    broker: Mosquitto, handler: FakeCommandHandler
) -> None:
    link = link_to(broker, handler)
    async with running(link):
        async with broker.listener(ALL) as listener:
            await listener.until("/state")
        broker.kill()
        await until(lambda: "refused" in link.problem)
        for number in range(REVERSALS_WAITING_MAX + 44):
            link.reversal("x", REVERSAL._replace(cycle=number))
        link.due("x", True)
        handler.set_axis(0, learning_due=True, version=1, learned=LEARNED)
        await broker.start()
        async with broker.listener(ALL) as listener:
            await listener.until("/state", lambda state: state.content["axis"]["x"]["learning_due"])
            await broker.publish(COMMAND, '{"id": "1", "command": "enable_observer"}')
            ack = await listener.until("/command/ack")
        messages = {message.topic.removeprefix(ROOT): message for message in listener.received}
    assert ack.content["accepted"]
    assert messages["/online"].payload == "online"
    assert messages["/axis/x/learning_due"].content["due"]
    assert messages["/axis/x/learned"].content["version"] == 1
    assert link.reversals_dropped == 44
    assert messages["/state"].content["reversals_dropped"] == 44


async def test_an_answer_that_was_not_confirmed_is_sent_after_the_reconnection(
    broker: Mosquitto, handler: FakeCommandHandler, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("servo_ctrl.telemetry.mqtt.client.RESPONSE_LIMIT_S", 0.3)
    link = link_to(broker, handler)
    async with running(link):
        async with broker.listener(ALL) as listener:
            await listener.until("/state")
            # The broker has the command, and hangs: nobody confirms the answer.
            await broker.publish(COMMAND, '{"id": "1", "command": "start_learning"}')
            broker.signal(signal.SIGSTOP)
        link._answers.put_nowait(json.dumps({"id": "late"}).encode())
        await until(lambda: link.problem != "")
        listening, enter = asyncio.Event(), client._enter

        async def enter_once_somebody_listens(connecting: Any) -> None:
            await listening.wait()
            await enter(connecting)

        monkeypatch.setattr(client, "_enter", enter_once_somebody_listens)
        broker.kill()
        await broker.start()
        async with broker.listener(f"{ROOT}/command/ack") as listener:
            listening.set()
            await listener.until("/command/ack", lambda ack: ack.content["id"] == "late")


async def test_without_a_broker_the_link_waits_and_stops_at_once(
    handler: FakeCommandHandler, tmp_path: Path
) -> None:
    link = link_to(Mosquitto(tmp_path), handler)
    async with running(link):
        await until(lambda: "refused" in link.problem)
        link.changed()
        link.reversal("x", REVERSAL)
        link.due("x", True)


async def test_a_silent_broker_times_out(
    handler: FakeCommandHandler, broker: Mosquitto, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("servo_ctrl.telemetry.mqtt.client.RESPONSE_LIMIT_S", 0.2)
    broker.signal(signal.SIGSTOP)
    link = link_to(broker, handler)
    async with running(link):
        await until(lambda: "timed out" in link.problem)
        broker.signal(signal.SIGCONT)
        await until(lambda: link.problem == "")


async def test_a_stop_while_the_broker_hangs_is_bounded(
    handler: FakeCommandHandler, broker: Mosquitto
) -> None:
    link = link_to(broker, handler)
    async with running(link):
        await until(lambda: link.problem == "")
        broker.signal(signal.SIGSTOP)
        link.changed()
        await asyncio.sleep(0)
    broker.signal(signal.SIGCONT)


async def test_a_stop_ends_the_link_at_any_moment(broker: Mosquitto, handler: FakeCommandHandler) -> None:
    for moments in range(40):
        async with running(link_to(broker, handler)):
            for _ in range(moments):
                await asyncio.sleep(0.0005)
    async with broker.listener(f"{ROOT}/online") as late:
        assert (await late.until("/online")).payload == "offline"
