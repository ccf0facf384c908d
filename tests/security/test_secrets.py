"""Secrets that are wrong, refused or shown to the page: no message, file or log has them."""

import contextlib
import gc
import http.client
import logging
import os
import re
import socket
import ssl
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote

import pytest
from broker_certificates import make_certificates, needs_openssl
from fake_command_handler import FakeCommandHandler
from free_port import free_tcp_port
from marked_secrets import MarkedSecret
from mosquitto import Mosquitto, needs_mosquitto
from mqtt_bench import link_to, running, until

from servo_ctrl.config.load import load_machine
from servo_ctrl.config.mqtt_model import MqttConfig
from servo_ctrl.errors import ConfigError
from servo_ctrl.hmi.access.users import Role, add_token

START_LIMIT_S = 60.0
MACHINES = Path(__file__).parents[2] / "machines"


def test_the_marked_secret_is_found_in_every_encoding(tmp_path: Path) -> None:
    secret = MarkedSecret("a/secret?")
    for form in (b'{"p":"a/secret?"}', b"p=a%2Fsecret%3F", b"YS9zZWNyZXQ/", b"612f7365637265743f"):
        (tmp_path / "file").write_bytes(b"before " + form)
        assert secret.in_files(tmp_path) == [tmp_path / "file"]
    assert not secret.in_bytes(b"a/secret!")


@needs_mosquitto
async def test_a_password_that_the_broker_refuses_is_in_no_log(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.DEBUG)
    secret, own = MarkedSecret(), tmp_path / "own"
    own.touch(0o600)
    own.write_text(secret.text, encoding="utf-8")
    (tmp_path / "passwords").touch()
    async with Mosquitto(
        tmp_path, f"allow_anonymous false\npassword_file {tmp_path / 'passwords'}"
    ) as broker:
        link = link_to(broker, FakeCommandHandler(), username="table", password_file=own)
        async with running(link):
            await until(lambda: "authorized" in link.problem)
    assert "not connected" in caplog.text
    for content in (caplog.text, link.problem, repr(link), repr(vars(link))):
        assert not secret.in_bytes(content.encode())


@pytest.mark.parametrize(
    ("section", "reason"),
    [
        ('password = "{}"', "mqtt.password: unknown key"),
        ('host = "anna:{}@broker"', "mqtt.host: give it without user and password"),
    ],
)
def test_a_password_in_the_wrong_place_is_not_repeated(section: str, reason: str, tmp_path: Path) -> None:
    secret, path = MarkedSecret(f"marked-{'x' * 20}"), tmp_path / "controller.toml"
    table = (MACHINES / "xy_table" / "controller.toml").read_text(encoding="utf-8")
    path.write_text(f"{table}\n[mqtt]\n{section.format(secret.text)}\n", encoding="utf-8")
    with pytest.raises(ConfigError) as refused:
        load_machine(path)
    assert reason in str(refused.value)
    assert not secret.in_bytes(str(refused.value).encode())
    with pytest.raises(ValueError, match="without user and password") as refused_address:
        MqttConfig().at(f"anna:{secret.text}@broker:1883")
    assert not secret.in_bytes(str(refused_address.value).encode())


@pytest.fixture
def page(tmp_path: Path) -> Iterator[tuple[int, Path, subprocess.Popen[bytes]]]:
    """The page as it is for others than this host, without a machine: its port, its output, its process."""
    certificates = make_certificates(tmp_path / "certificates", "nobody")
    port = free_tcp_port()
    add_token(tmp_path / "access.toml", "bert", Role.VIEW)
    output = tmp_path / "output"
    command = [
        *(sys.executable, "-m", "servo_ctrl.hmi", "serve", "--socket", str(tmp_path / "none.sock")),
        *("--listen", f"127.0.0.1:{port}", "--access", str(tmp_path / "access.toml")),
        *("--certificate", str(certificates / "broker.pem"), "--key", str(certificates / "broker.key")),
        *("--recordings", str(tmp_path / "recordings")),
    ]
    # the page's library looks for a test runner in the environment
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTEST")}
    with output.open("wb") as file:
        process = subprocess.Popen(command, stdout=file, stderr=file, cwd=tmp_path, env=environment)
    try:
        deadline_s = time.monotonic() + START_LIMIT_S
        while True:
            assert process.poll() is None, output.read_text()
            assert time.monotonic() < deadline_s, "the page does not start"
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 1.0):
                break
            time.sleep(0.1)
        yield port, output, process
    finally:
        process.kill()
        process.wait(10.0)


@needs_openssl
def test_tokens_and_sessions_are_in_nothing_that_the_page_writes(
    page: tuple[int, Path, subprocess.Popen[bytes]], tmp_path: Path
) -> None:
    port, output, process = page
    right, wrong = MarkedSecret(add_token(tmp_path / "access.toml", "anna", Role.OPERATE)), MarkedSecret()
    trusted = ssl.create_default_context(cafile=tmp_path / "certificates" / "ca.pem")

    def posted(token: str) -> tuple[int, str, bytes]:
        connection = http.client.HTTPSConnection("127.0.0.1", port, timeout=START_LIMIT_S, context=trusted)
        headers = {"Origin": f"https://127.0.0.1:{port}", "Content-Type": "application/x-www-form-urlencoded"}
        connection.request("POST", "/login", f"token={quote(token, safe='')}", headers)
        response = connection.getresponse()
        found = response.status, response.getheader("set-cookie", ""), response.read()
        connection.close()
        return found

    status, _, body = posted(wrong.text)
    assert status == 401
    assert not wrong.in_bytes(body)
    status, cookie, body = posted(right.text)
    assert status == 303
    value = re.search(r"bench_session=([^;]+)", cookie)
    assert value is not None
    session = MarkedSecret(value[1])
    process.terminate()
    process.wait(20.0)
    written = output.read_bytes()
    assert b"anna (operate) logged in from 127.0.0.1" in written
    assert b"unknown token from 127.0.0.1" in written
    for secret in (right, wrong, session):
        assert secret.in_files(tmp_path) == []
        assert not secret.in_bytes(body)
    gc.collect()
