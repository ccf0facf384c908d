"""A run with a marked password: nothing that it writes, logs, sends or shows contains the password."""

import asyncio
import contextlib
import json
import logging
import subprocess
from pathlib import Path
from typing import Any

import aiomqtt
import pytest
from marked_secrets import MarkedSecret
from mosquitto import Mosquitto, needs_mosquitto

from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.daemon.page.page_process import PageOptions
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.recording.command_log import COMMANDS_FILE
from servo_ctrl.recording.recorder import HEADER_FILE

PROGRAM = '[[step]]\nkind = "circle"\nlabel = "round"\nradius_mm = 2.0\nfeed_mm_min = 2000.0\nturns = 2.0\n'
ROOT = "servo_ctrl/xy_table"


def broker_with_password(folder: Path, password: str) -> Mosquitto:
    file = folder / "broker_passwords"
    file.touch(0o600)
    for user in ("controller", "watcher"):
        subprocess.run(["mosquitto_passwd", "-b", file, user, password], check=True)
    return Mosquitto(folder, f"allow_anonymous false\npassword_file {file}")


async def everything_on_the_socket(path: Path, received: bytearray) -> None:
    """Send a request, and collect all bytes until the run ends."""
    reader, writer = await asyncio.open_unix_connection(path)
    who = {"user": "anna", "role": "operate", "address": "192.0.2.7"}
    request = json.dumps({"kind": "request", "id": 1, "who": who, "do": "clear_counters"}).encode()
    writer.write(b"J" + len(request).to_bytes(4, "little") + request)
    with contextlib.suppress(ConnectionError):
        while content := await reader.read(65536):
            received += content
    writer.close()


@needs_mosquitto
async def test_password_of_the_broker_is_in_nothing_that_a_run_leaves_behind(
    bench: Any, tmp_path: Path, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    caplog.set_level(logging.DEBUG)
    secret, messages, received = MarkedSecret(), list[bytes](), bytearray()
    async with broker_with_password(tmp_path, secret.text) as broker:
        section = (
            f'[mqtt]\nport = {broker.port}\nstream = true\nusername = "controller"\npassword_file = "own"\n'
        )
        directory = bench.machine({"[machine]": f"{section}[machine]"})
        own = directory / "own"
        own.touch(0o600)
        own.write_text(secret.text + "\n", encoding="utf-8")
        (directory / "round.toml").write_text(PROGRAM, encoding="utf-8")
        bench.simulate(directory)
        machine = load_machine(directory)
        motion = load_program(directory / "round.toml", machine)
        tasks: list[asyncio.Task[None]] = []

        def on_socket(path: Path) -> None:
            tasks.append(asyncio.create_task(everything_on_the_socket(path, received)))

        async with (
            asyncio.timeout(120.0),
            aiomqtt.Client("127.0.0.1", broker.port, username="watcher", password=secret.text) as client,
        ):
            await client.subscribe("#")
            page = PageOptions(None, on_socket)
            report = await run_machine(machine, motion, bench.bus_spec, "lockstep", tmp_path / "r", page=page)
            async for message in client.messages:
                messages.append(message.topic.value.encode() + bytes(message.payload))
                if messages[-1].endswith(b"/onlineoffline"):
                    break
            await asyncio.gather(*tasks)
    printed = capfd.readouterr()
    assert report.completed
    assert "MQTT 127.0.0.1" in caplog.text
    assert len(messages) > 3
    assert b'"kind":"status"' in bytes(received)
    assert {HEADER_FILE, COMMANDS_FILE} <= {path.name for path in (tmp_path / "r").iterdir()}
    for content in (caplog.text, printed.out, printed.err, repr(report), repr(machine)):
        assert not secret.in_bytes(content.encode())
    assert not any(secret.in_bytes(message) for message in messages)
    assert not secret.in_bytes(bytes(received))
    assert secret.in_files(tmp_path, but=[own]) == []
