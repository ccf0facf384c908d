"""Dialogues with the real server of the local socket, by a client that sends bytes."""

import asyncio
import contextlib
import json
import os
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from local_socket_bench import BUS, CHANNELS, LIMIT_S, WHO, LocalSocketBench, RawClient, connected

from servo_ctrl.commands.bus_status import BusStatus
from servo_ctrl.commands.local_codec import from_plain
from servo_ctrl.commands.local_frames import JSON, REQUEST_LIMIT, frame
from servo_ctrl.commands.local_messages import LocalAnswer, server_message
from servo_ctrl.telemetry.local_socket import client as local_socket_client
from servo_ctrl.telemetry.local_socket.client import BUFFER_LIMIT
from servo_ctrl.telemetry.local_socket.server import CLIENTS_MAX


async def until(condition: Any) -> None:
    async with asyncio.timeout(LIMIT_S):
        while not condition():  # noqa: ASYNC110  # the server has no event for it
            await asyncio.sleep(0.01)


async def test_another_user_is_refused_by_peer_credentials(
    bench: LocalSocketBench, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(local_socket_client, "peer_uid", lambda _socket: os.geteuid() + 1)
    async with connected(path) as client:
        await client.ends()
    assert bench.server.clients == 0


async def test_the_kernel_identifies_the_peer(bench: LocalSocketBench, path: Path) -> None:
    async with connected(path) as client:
        connection = client.writer.get_extra_info("socket")
        assert local_socket_client.peer_uid(connection) == os.geteuid()


async def test_every_message_fits_its_model_and_hello_comes_first(
    bench: LocalSocketBench, path: Path
) -> None:
    async with connected(path) as client:
        assert (await client.message())["kind"] == "hello"
        bench.cycle()
        status = await client.message("status")
        assert server_message(json.dumps(status).encode()) == bench.handler.now._replace(
            time=status["time"], bus=from_plain(BusStatus, BUS)
        )
        answer = await client.ask(do="command", command="start_program")
        assert server_message(json.dumps(answer).encode()) == LocalAnswer(id=1, accepted=True)


async def test_rows_arrive_complete_in_order_from_the_connection_on(
    bench: LocalSocketBench, path: Path
) -> None:
    bench.cycle(7)
    async with connected(path) as client:
        await client.message("hello")
        bench.cycle(600)  # more than the ring holds: what is gone is counted
        first, missed, values = await client.rows()
        assert (first, missed) == (95, 88)
        bench.cycle(5)
        first, missed, after = await client.rows()
        assert (first, missed) == (607, 88)
    numbers = np.concatenate((values, after))[:, CHANNELS.index("cycle")]
    np.testing.assert_array_equal(numbers, np.arange(95, 612))


@pytest.mark.parametrize(
    "data",
    [
        b"X" + struct.pack("<I", 4) + b"1234",
        b"R" + struct.pack("<I", 4) + b"1234",
        b"J" + struct.pack("<I", REQUEST_LIMIT + 1),
        b"GET / HTTP/1.1\r\n\r\n",
    ],
)
async def test_a_client_without_valid_frames_gets_an_error_and_is_disconnected(
    bench: LocalSocketBench, path: Path, data: bytes
) -> None:
    async with connected(path) as client:
        client.send(data)
        assert (await client.message("answer"))["refusal"] == "malformed"
        await client.ends()
    await until(lambda: bench.server.clients == 0)


async def test_frames_may_arrive_in_pieces_or_several_at_once(bench: LocalSocketBench, path: Path) -> None:
    def request(number: int) -> bytes:
        asked = {"id": number, "who": WHO, "do": "command", "command": "home"}
        return frame(JSON, json.dumps(asked).encode())

    async with connected(path) as client:
        for byte in request(1):
            client.send(bytes((byte,)))
            await client.writer.drain()
        assert (await client.message("answer"))["id"] == 1
        client.send(request(2) + request(3))
        assert [(await client.message("answer"))["id"] for _ in range(2)] == [2, 3]


async def test_a_client_that_never_reads_costs_bounded_memory_and_the_other_sees_everything(
    bench: LocalSocketBench, path: Path
) -> None:
    async with connected(path) as idle, connected(path) as reader:
        await reader.message("hello")
        await until(lambda: bench.server.clients == 2)
        idle_end, _ = bench.server._clients
        taken = 0
        for _ in range(300):
            bench.cycle(256)
            taken += len((await reader.rows())[2])
        assert taken == bench.rows.end
        assert idle_end.unread < 2 * BUFFER_LIMIT
        bench.cycle(1)
        assert idle_end.missed == 0, "counted when it reads again"
        first, missed, read = 0, 0, 0
        while missed == 0:
            first, missed, values = await idle.rows()
            read += len(values)
            bench.cycle(1)
            await asyncio.sleep(0)
        assert first + len(values) == read + missed, "every row has arrived or is counted"


async def test_too_many_clients_are_refused(bench: LocalSocketBench, path: Path) -> None:
    async with contextlib.AsyncExitStack() as stack:
        clients = [await stack.enter_async_context(connected(path)) for _ in range(CLIENTS_MAX)]
        for client in clients:
            await client.message("hello")
        async with connected(path) as late:
            await late.ends()
        assert bench.server.clients == CLIENTS_MAX


async def test_closing_the_server_closes_every_connection(bench: LocalSocketBench) -> None:
    async with contextlib.AsyncExitStack() as stack:
        async with bench.server.serving() as socket:
            clients: list[RawClient] = [await stack.enter_async_context(connected(socket)) for _ in range(2)]
            await clients[0].message("hello")
            for _ in range(100):
                bench.cycle(512)
        await clients[1].ends()
    assert bench.server.clients == 0
