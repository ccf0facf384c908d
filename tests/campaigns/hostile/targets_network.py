"""Fuzz targets: messages by MQTT, the local socket, and HTTP."""

import asyncio
import functools
import json
from collections.abc import Awaitable, Sequence
from typing import Any

from fake_command_handler import FakeCommandHandler
from fastapi import FastAPI
from local_socket_bench import CHANNELS, WHO, LocalSocketBench

from servo_ctrl.commands.client_activity import ClientActivity
from servo_ctrl.commands.local_codec import MessageError
from servo_ctrl.commands.local_frames import (
    JSON,
    MESSAGE_LIMIT,
    ROWS,
    FrameError,
    frame,
    read_frame,
    row_block,
    rows_frame,
)
from servo_ctrl.commands.local_messages import LocalRequest, server_message
from servo_ctrl.hmi.access.guard import LOGIN, Guard
from servo_ctrl.hmi.access.login import add_login
from servo_ctrl.hmi.access.sessions import Sessions
from servo_ctrl.hmi.access.users import Access
from servo_ctrl.telemetry.mqtt.commands import MqttCommands
from tests.campaigns.hostile.targets import GOLDEN, file_with, target

REFUSALS = {"none", "unknown", "out_of_range", "wrong_state", "storage", "malformed", "stale", "wrong_topic"}


@functools.cache
def _loop() -> asyncio.AbstractEventLoop:
    return asyncio.new_event_loop()


def waited(coroutine: Awaitable[Any]) -> Any:
    """Run a coroutine in a loop of this module; return its result."""
    return _loop().run_until_complete(coroutine)


def _mqtt() -> Sequence[bytes]:
    messages = [
        {"id": "1", "command": "start_learning", "axis": "x"},
        {"id": "2", "command": "quick_stop"},
        {"id": "3", "setting": "required_um", "value": 3.5},
        {"id": "4", "setting": "learner", "value": "paper"},
    ]
    return [json.dumps(message).encode() for message in messages]


@target(
    "servo_ctrl.telemetry.mqtt.commands", _mqtt, words=(b'"id"', b"NaN", b"Infinity", b"\\ud800", b"\\u0000")
)
def mqtt_command(data: bytes) -> None:
    handler = FakeCommandHandler()
    answers = MqttCommands(handler, None, lambda text: text.encode("ascii"))
    for retained in (True, False, False):
        answer = answers.answer(data, retained=retained)
        assert answer.refusal in REFUSALS
        json.dumps(answer._asdict()).encode()
    assert len(handler.requests) + len(handler.changes) <= 1  # nothing is done twice
    assert handler.jogs == []


def _requests() -> Sequence[bytes]:
    kinds = [
        {"do": "command", "command": "start_program"},
        {"do": "setting", "setting": "required_m", "value": 3e-6},
        {"do": "jog", "axis": "x", "value": 0.01},
        {"do": "load_program", "program": {"name": "a.toml", "text": "[[step]]"}},
        {"do": "read_object", "node": 1, "index": 0x6065},
        {"do": "write_object", "node": 1, "index": 0x6065, "value": 7},
        {"do": "take_control"},
    ]
    return [json.dumps({"kind": "request", "id": 1, "who": WHO, **kind}).encode() for kind in kinds]


@target(
    "servo_ctrl.telemetry.local_socket.requests", _requests, words=(b"1e999", b"\\ud800", b'"index"', b"-1")
)
def local_request(data: bytes) -> None:
    """Send a request to the server; return its answers."""

    async def served() -> list[bytes]:
        bench, answers = LocalSocketBench(), []
        request = bench.requests.read(data)
        if isinstance(request, LocalRequest):
            bench.requests.carry_out(request, answers.append, ClientActivity())
            while not answers:  # noqa: ASYNC110  # a later answer raises no event
                await asyncio.sleep(0)
        else:
            answers.append(request)
        for entry in bench.logged:
            json.dumps(entry).encode()
        await bench.requests.close()
        return answers

    (answer,) = waited(served())
    assert json.loads(answer)["kind"] == "answer"


def _frames() -> Sequence[bytes]:
    rows = rows_frame(7, 0, 2, bytes(2 * 8 * len(CHANNELS)))
    return [frame(JSON, request) + rows for request in _requests()]


@target(
    "servo_ctrl.commands.local_frames",
    _frames,
    declared=(FrameError, asyncio.IncompleteReadError),
    words=(JSON, ROWS, b"\xff\xff\xff\xff"),
)
def local_frames(data: bytes) -> None:
    async def read() -> None:
        reader = asyncio.StreamReader()
        reader.feed_data(data)
        reader.feed_eof()
        while not reader.at_eof():
            kind, payload = await read_frame(reader, MESSAGE_LIMIT)
            if kind == ROWS:
                block = row_block(payload, len(CHANNELS))
                assert block.values.shape[1] == len(CHANNELS)

    waited(read())


def _status() -> Sequence[bytes]:
    bench = LocalSocketBench()
    pieces = bench.status()
    while True:
        try:
            next(pieces)
        except StopIteration as end:
            return [end.value + b',"rows_missed":0}']


@target("servo_ctrl.commands.local_messages", _status, declared=MessageError, short=150)
def status_at_the_page(data: bytes) -> None:
    """Read a server's message as the page does."""
    server_message(data)


@functools.cache
def _page() -> Guard:
    path = file_with((GOLDEN / "access.toml").read_bytes(), "page/access.toml")
    path.chmod(0o600)
    access = Access(path)
    app = FastAPI()
    sessions = Sessions(access)
    add_login(app, access, sessions)

    @app.post("/stop")
    async def stop() -> dict[str, bool]:  # what only somebody who is logged in may reach
        raise AssertionError("a client without access came through")

    return Guard(app, access, sessions)


SECRET = b"x" * 43
HTTP = [
    b"GET /login HTTP/1.1\r\nhost: localhost\r\naccept: text/html\r\n\r\n",
    b"POST /login HTTP/1.1\r\nhost: bench\r\norigin: https://bench\r\n\r\ntoken=" + SECRET,
    b"POST /stop HTTP/1.1\r\nhost: bench\r\norigin: https://bench\r\ncookie: bench_session="
    + SECRET
    + b"\r\n\r\n",
    b"POST /logout HTTP/1.1\r\nhost: bench\r\norigin: https://bench\r\ncookie: bench_session=1\r\n\r\n",
    b"WEBSOCKET /_nicegui_ws HTTP/1.1\r\nhost: bench\r\norigin: https://bench\r\n\r\n",
]


@target(
    "servo_ctrl.hmi.access.guard",
    lambda: HTTP,
    words=(
        b"cookie: ",
        b"origin: ",
        b"host: ",
        b"[",
        b"]",
        b"%00",
        b"token=",
        b"; ",
        b'"',
        b"bench_browser=",
    ),
    short=150,
)
def page(data: bytes) -> None:
    """Pass requests to the guard as uvicorn does; those that uvicorn refuses do not occur."""
    head, _, body = data.partition(b"\r\n\r\n")
    first, *lines = head.split(b"\r\n")
    words = [*first.split(b" "), b"", b""]
    method, path = words[0].decode("ascii", "replace").upper(), words[1].decode("utf-8", "replace")
    headers = [
        (name.strip().lower(), value.strip()) for name, _, value in (line.partition(b":") for line in lines)
    ]
    kind = "websocket" if method == "WEBSOCKET" else "http"
    scope = {
        "type": kind,
        "asgi": {"version": "3.0"},
        "http_version": "1.1",
        "method": method,
        "path": path,
        "raw_path": words[1],
        "root_path": "",
        "scheme": "https",
        "query_string": b"",
        "headers": headers,
        "client": ("192.0.2.7", 40000),
        "server": ("bench", 443),
        "state": {},
    }
    answered: list[dict[str, Any]] = []
    waiting = [{"type": "http.request", "body": body, "more_body": False}, {"type": "http.disconnect"}]

    async def receive() -> dict[str, Any]:
        return {"type": "websocket.connect"} if kind == "websocket" else waiting.pop(0)

    async def send(message: dict[str, Any]) -> None:
        answered.append(message)

    waited(_page()(scope, receive, send))
    status = answered[0].get("status", 1008)
    assert status in {200, 303, 400, 401, 403, 404, 405, 429, 1008}, status
    assert all(
        b"bench_session=" not in value
        for _, value in answered[0].get("headers", ())
        if b"Max-Age=0" not in value
    )
    assert path == LOGIN or status != 200


def _token() -> Sequence[bytes]:
    return [SECRET]


@target("servo_ctrl.hmi.access.users", _token)
def token(data: bytes) -> None:
    path = file_with((GOLDEN / "access.toml").read_bytes(), "token/access.toml")
    path.chmod(0o600)
    assert Access(path).owner_of(data.decode("utf-8", "surrogateescape")) is None
