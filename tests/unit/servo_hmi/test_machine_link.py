"""The page's end of the local socket, against the real server and against one that misbehaves."""

import asyncio
import contextlib
import os
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any

import pytest
from local_socket_bench import CHANNELS, LIMIT_S, WHO, LocalSocketBench

from servo_ctrl.commands.command import CommandResult, Refusal
from servo_ctrl.commands.local_frames import JSON, ROWS, frame
from servo_ctrl.commands.local_messages import Requester
from servo_ctrl.commands.stage import Stage
from servo_ctrl.hmi.link import machine_link
from servo_ctrl.hmi.link.machine_link import MachineLink

ANNA = Requester.model_validate(WHO)


@contextlib.asynccontextmanager
async def running(link: MachineLink) -> AsyncIterator[None]:
    task = asyncio.create_task(link.run())
    try:
        yield
        assert not task.done()
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


async def until(condition: Callable[[], Any]) -> None:
    async with asyncio.timeout(LIMIT_S):
        while not condition():  # noqa: ASYNC110  # a link tells of a status only
            await asyncio.sleep(0.01)


async def test_the_link_keeps_messages_and_sends_requests(tmp_path: Path) -> None:
    bench = LocalSocketBench()
    async with bench.server.serving() as socket:
        link = MachineLink(socket)
        stages: list[Stage] = []
        link.listeners.append(lambda _status: 1 / 0)  # type: ignore[arg-type,return-value]
        link.listeners.append(lambda status: stages.append(status.stage))
        assert (link.hello, link.status, link.connected) == (None, None, False)
        async with running(link):
            await until(lambda: link.status)
            assert link.hello is not None
            assert link.hello.machine == "bench"
            assert stages[0] is Stage.READY, "a listener that fails does not keep the others from hearing"
            bench.cycle(20)
            await until(lambda: len(link.rows) == 20)
            assert list(link.rows.column("cycle")) == list(range(20))
            assert (await link.request(ANNA, "command", command="start_program")).accepted
            bench.handler.verdict = CommandResult(Refusal.WRONG_STATE, "not now")
            answer = await link.request(ANNA, "command", command="start_program")
            assert (answer.accepted, answer.reason) == (False, "not now")
            assert (await link.request(ANNA, "command", command="enable", axis="x")).reason == "not now"
            assert (await link.request(ANNA, "read_object", node=1, index=0x6065, subindex=0)).value == 1000
            long = {"name": "long.ngc", "text": "G0 X1\n" * 50_000}
            assert "too long" in (await link.request(ANNA, "load_program", program=long)).reason
            assert (await link.request(ANNA, "juggle")).refusal == "malformed"


async def test_the_link_connects_again_and_row_numbers_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine_link, "LONGEST_RETRY_S", 0.2)
    bench = LocalSocketBench()
    async with bench.server.serving() as socket:
        link = MachineLink(socket)
        async with running(link):
            await until(lambda: link.connected)
            bench.cycle(10)
            await until(lambda: len(link.rows) == 10)
            bench.server._clients[0].abort()
            await until(lambda: not link.connected)
            assert link.problem
            answer = await link.request(ANNA, "command", command="home")
            assert (answer.accepted, answer.refusal) == (False, "unreachable")
            assert link.status is not None, "what was heard last stays"
            await until(lambda: link.connected)
            bench.cycle(5)
            await until(lambda: link.rows.end == 15)
            assert link.rows.since(10)[0] == 10


@contextlib.asynccontextmanager
async def serving(path: Path, sent: bytes) -> AsyncIterator[list[int]]:
    """A server that sends this and then nothing; yields how often it was connected to."""
    connections: list[int] = []

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        connections.append(1)
        writer.write(sent)
        with contextlib.suppress(ConnectionError):
            await reader.read()
        writer.close()

    server = await asyncio.start_unix_server(serve, path)
    try:
        yield connections
    finally:
        server.close()


def greeting() -> bytes:
    return frame(JSON, LocalSocketBench().server._hello)


@pytest.mark.parametrize(
    "sent",
    [
        b"HTTP/1.1 400 Bad Request\r\n",
        frame(JSON, b"{"),
        frame(JSON, b'{"kind": "hello", "format": 2}'),
        b"J\xff\xff\xff\xff",
        greeting() + frame(ROWS, bytes(20 + 8 * len(CHANNELS))),
        greeting() + frame(ROWS, b"123"),
        greeting(),
    ],
)
async def test_an_invalid_or_silent_server_is_disconnected_and_tried_again(
    tmp_path: Path, sent: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(machine_link, "SILENCE_TIMEOUT_S", 0.1)
    async with serving(tmp_path / "s", sent) as connections:
        link = MachineLink(tmp_path / "s")
        async with running(link):
            await until(lambda: len(connections) >= 2)
            await until(lambda: not link.connected)
            assert link.problem


async def test_a_request_that_is_not_answered_ends_within_its_bound(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(machine_link, "ANSWER_TIMEOUT_S", 0.1)
    async with serving(tmp_path / "s", greeting()):
        link = MachineLink(tmp_path / "s")
        async with running(link):
            await until(lambda: link.connected)
            answer = await link.request(ANNA, "clear_counters")
            assert (answer.accepted, answer.refusal) == (False, "unreachable")


async def test_the_link_waits_for_a_server(tmp_path: Path) -> None:
    link = MachineLink(tmp_path / "s")
    async with running(link):
        await until(lambda: os.strerror(2) in link.problem)
        async with serving(tmp_path / "s", greeting()):
            await until(lambda: link.connected)


async def test_an_unexpected_message_does_not_end_the_link(monkeypatch: pytest.MonkeyPatch) -> None:
    handled = machine_link.server_message
    failures = iter([ZeroDivisionError("nobody expected that")])

    def broken_once(payload: bytes) -> Any:
        for error in failures:
            raise error
        return handled(payload)

    monkeypatch.setattr(machine_link, "server_message", broken_once)
    async with LocalSocketBench().server.serving() as socket:
        link = MachineLink(socket)
        async with running(link):
            await until(lambda: link.status)
