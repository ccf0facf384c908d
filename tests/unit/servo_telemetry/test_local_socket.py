"""Dialogues with the real server of the local socket, by a client that sends bytes."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import socket
import stat
import struct
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from local_bench import CHANNELS, LIMIT_S, WHO, LocalBench, RawClient, connected
from pydantic import TypeAdapter

from servo_ctrl.config.desk import Command, Refusal, Setting, Verdict
from servo_ctrl.config.desk import Request as DeskRequest
from servo_ctrl.config.local_frames import JSON, REQUEST_LIMIT, frame
from servo_ctrl.config.local_messages import ServerMessage
from servo_ctrl.telemetry import local_socket_client
from servo_ctrl.telemetry.local_socket import CLIENTS_AT_MOST, LocalSocketError
from servo_ctrl.telemetry.local_socket_client import BUFFER_LIMIT, MALFORMED_LIMIT

if TYPE_CHECKING:
    from collections.abc import AsyncIterator
    from pathlib import Path


@pytest.fixture
async def bench() -> LocalBench:
    return LocalBench()


@pytest.fixture
async def path(bench: LocalBench) -> AsyncIterator[Path]:
    async with bench.server.serving() as socket:
        yield socket


async def until(condition: Any) -> None:
    async with asyncio.timeout(LIMIT_S):
        while not condition():  # noqa: ASYNC110  # the server tells nobody
            await asyncio.sleep(0.01)


async def test_socket_is_for_its_owner_alone_and_goes_with_the_server(bench: LocalBench) -> None:
    async with bench.server.serving() as socket:
        assert stat.S_IMODE(socket.parent.stat().st_mode) == 0o700
        assert stat.S_IMODE(socket.stat().st_mode) == 0o600
    assert not socket.parent.exists()


async def test_socket_at_a_chosen_path_needs_a_directory_of_ours_alone(
    bench: LocalBench, tmp_path: Path
) -> None:
    directory = tmp_path / "run"
    with pytest.raises(LocalSocketError, match="make it, mode 700"):
        await bench.server.serving(directory / "page.sock").__aenter__()
    directory.mkdir(0o755)
    with pytest.raises(LocalSocketError, match="chmod 700"):
        await bench.server.serving(directory / "page.sock").__aenter__()
    directory.chmod(0o700)
    (directory / "file").touch()
    with pytest.raises(LocalSocketError, match="is no socket"):
        await bench.server.serving(directory / "file").__aenter__()
    async with bench.server.serving(directory / "page.sock") as path, connected(path) as client:
        assert (await client.message())["kind"] == "hello"
    assert sorted(entry.name for entry in directory.iterdir()) == ["file"]


async def test_socket_of_a_living_controller_is_left_to_it_and_that_of_a_killed_one_replaced(
    bench: LocalBench, tmp_path: Path
) -> None:
    left = tmp_path / "page.sock"
    with socket.socket(socket.AF_UNIX) as other:
        other.bind(str(left))
        other.listen()
        with pytest.raises(LocalSocketError, match="another controller serves it"):
            await bench.server.serving(left).__aenter__()
    async with bench.server.serving(left) as path, connected(path) as client:
        assert (await client.message())["kind"] == "hello"


async def test_another_user_is_refused_by_the_kernels_word(
    bench: LocalBench, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(local_socket_client, "peer_uid", lambda _socket: os.geteuid() + 1)
    async with connected(path) as client:
        await client.ends()
    assert bench.server.clients == 0


async def test_kernel_tells_who_is_at_the_other_end(bench: LocalBench, path: Path) -> None:
    async with connected(path) as client:
        connection = client.writer.get_extra_info("socket")
        assert local_socket_client.peer_uid(connection) == os.geteuid()


async def test_every_message_is_what_the_models_say_and_hello_comes_first(
    bench: LocalBench, path: Path
) -> None:
    adapter: TypeAdapter[Any] = TypeAdapter(ServerMessage)
    async with connected(path) as client:
        assert (await client.message())["kind"] == "hello"
        bench.cycle()
        status = await client.message("status")
        assert adapter.validate_python(status, strict=False).stage == "ready"
        answer = await client.ask(do="command", command="start_program")
        assert adapter.validate_python(answer).accepted


async def test_rows_arrive_whole_in_order_and_from_now_on(bench: LocalBench, path: Path) -> None:
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


async def test_requests_reach_the_desk_and_its_answer_comes_back(bench: LocalBench, path: Path) -> None:
    async with connected(path) as client:
        assert (await client.ask(do="command", command="enable", axis="x"))["accepted"]
        assert (await client.ask(do="setting", setting="required_m", value=5e-6))["accepted"]
        assert (await client.ask(do="setting", setting="learner", value="screw"))["accepted"]
        assert (await client.ask(do="setting", setting="adaptation", value=True))["accepted"]
        assert (await client.ask(do="jog", axis="y", value=-0.01))["accepted"]
        assert (await client.ask(do="clear_counters"))["accepted"]
        program = {"name": "part.toml", "text": "[[step]]"}
        assert (await client.ask(do="load_program", program=program))["accepted"]
        assert (await client.ask(do="read_object", node=1, index=0x6065))["value"] == 1000
        assert (await client.ask(do="write_object", node=1, index=0x6065, value=7))["accepted"]
        bench.desk.verdict = Verdict(Refusal.WRONG_STATE, "not now")
        refused = await client.ask(do="command", command="home")
    assert (refused["accepted"], refused["refusal"], refused["reason"]) == (False, "wrong_state", "not now")
    assert bench.desk.requests == [DeskRequest(Command.ENABLE, "x"), DeskRequest(Command.HOME, "")]
    assert bench.desk.changes == [
        (Setting.REQUIRED_M, 5e-6),
        (Setting.LEARNER, 2.0),
        (Setting.ADAPTATION, 1.0),
    ]
    assert bench.desk.jogs == [("y", -0.01)]
    assert bench.texts == [("part.toml", "[[step]]")]
    assert len(bench.desk.programs) == 1
    assert bench.cleared == 1
    assert bench.objects.values[1, 0x6065, 0] == 7


@pytest.mark.parametrize(
    ("fields", "refusal"),
    [
        ({"do": "dance"}, "malformed"),
        ({"do": "command"}, "malformed"),
        ({"do": "command", "command": "fly"}, "unknown"),
        ({"do": "command", "command": "enable", "node": 1}, "malformed"),
        ({"do": "command", "command": "enable", "colour": "red"}, "malformed"),
        ({"do": "setting", "setting": "required_m", "value": "much"}, "out_of_range"),
        ({"do": "setting", "setting": "required_m", "value": True}, "out_of_range"),
        ({"do": "setting", "setting": "adaptation", "value": 1}, "out_of_range"),
        ({"do": "jog", "axis": "x", "value": "fast"}, "malformed"),
        ({"do": "read_object", "node": 128, "index": 0}, "malformed"),
        ({"do": "read_object", "node": 1}, "malformed"),
        ({"do": "load_program", "program": {"name": "../evil.toml", "text": ""}}, "malformed"),
        ({"do": "command", "command": "enable", "who": {**WHO, "role": "king"}}, "malformed"),
    ],
)
async def test_what_makes_no_sense_is_refused_and_not_done(
    bench: LocalBench, path: Path, fields: dict[str, Any], refusal: str
) -> None:
    async with connected(path) as client:
        answer = await client.ask(**fields)
        assert (answer["accepted"], answer["refusal"]) == (False, refusal)
        assert answer["reason"]
        assert (await client.ask(do="clear_counters"))["accepted"], "it goes on"
    assert (bench.desk.requests, bench.desk.changes, bench.desk.jogs, bench.texts) == ([], [], [], [])


@pytest.mark.parametrize(
    "data",
    [
        b"X" + struct.pack("<I", 4) + b"1234",
        b"R" + struct.pack("<I", 4) + b"1234",
        b"J" + struct.pack("<I", REQUEST_LIMIT + 1),
        b"GET / HTTP/1.1\r\n\r\n",
    ],
)
async def test_who_sends_no_frames_is_told_and_sent_away_at_once(
    bench: LocalBench, path: Path, data: bytes
) -> None:
    async with connected(path) as client:
        client.send(data)
        assert (await client.message("answer"))["refusal"] == "malformed"
        await client.ends()
    await until(lambda: bench.server.clients == 0)


@pytest.mark.parametrize("payload", [b"", b"{", b"\xff\xfe", b"[]", b"null", b"NaN", b"[" * 5000])
async def test_bad_json_is_answered_a_few_times_and_then_ends_the_connection(
    bench: LocalBench, path: Path, payload: bytes
) -> None:
    async with connected(path) as client:
        for _ in range(MALFORMED_LIMIT):
            client.send(frame(JSON, payload))
            answer = await client.message("answer")
            assert (answer["id"], answer["refusal"]) == (0, "malformed")
        await client.ends()


async def test_a_frame_in_pieces_is_one_and_two_in_one_piece_are_two(bench: LocalBench, path: Path) -> None:
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


async def test_a_stop_does_not_wait_for_an_object_that_is_being_read(bench: LocalBench, path: Path) -> None:
    bench.objects.wait.clear()
    async with connected(path) as client:
        asked = {"id": 1, "who": WHO, "do": "read_object", "node": 1, "index": 0x6065}
        client.send(frame(JSON, json.dumps(asked).encode()))
        asked = {"id": 2, "who": WHO, "do": "command", "command": "quick_stop"}
        client.send(frame(JSON, json.dumps(asked).encode()))
        assert (await client.message("answer"))["id"] == 2
        bench.objects.wait.set()
        assert (await client.message("answer"))["value"] == 1000


async def test_a_client_that_never_reads_costs_bounded_memory_and_the_other_sees_everything(
    bench: LocalBench, path: Path
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


async def test_requests_of_a_flood_are_all_answered_in_turn(bench: LocalBench, path: Path) -> None:
    asked = frame(JSON, json.dumps({"id": 1, "who": WHO, "do": "clear_counters"}).encode())
    async with connected(path) as flooder, connected(path) as other:
        flooder.send(asked * 200)
        assert (await other.ask(do="command", command="quick_stop"))["accepted"]
        assert bench.cleared < 200, "the other did not wait for all of them"
        for _ in range(200):
            await flooder.message("answer")
    assert bench.cleared == 200


async def test_too_many_clients_are_refused(bench: LocalBench, path: Path) -> None:
    async with contextlib.AsyncExitStack() as stack:
        clients = [await stack.enter_async_context(connected(path)) for _ in range(CLIENTS_AT_MOST)]
        for client in clients:
            await client.message("hello")
        async with connected(path) as late:
            await late.ends()
        assert bench.server.clients == CLIENTS_AT_MOST


async def test_end_of_the_server_ends_every_connection_whether_it_reads_or_not(bench: LocalBench) -> None:
    async with contextlib.AsyncExitStack() as stack:
        async with bench.server.serving() as socket:
            clients: list[RawClient] = [await stack.enter_async_context(connected(socket)) for _ in range(2)]
            await clients[0].message("hello")
            for _ in range(100):
                bench.cycle(512)
        await clients[1].ends()
    assert bench.server.clients == 0


async def test_log_and_events_tell_who_wanted_what_but_of_a_jog_only_its_changes(
    bench: LocalBench, path: Path
) -> None:
    async with connected(path) as client:
        for value in (0.01, 0.01, 0.01, 0.02, 0.0, 0.0):
            await client.ask(do="jog", axis="x", value=value)
        await client.ask(do="load_program", program={"name": "a.ngc", "text": "G0 X1"})
        bench.desk.verdict = Verdict(Refusal.WRONG_STATE, "not now")
        await client.ask(do="command", command="enable")
    assert [entry.get("value") for entry in bench.logged[:3]] == [0.01, 0.02, 0.0]
    assert bench.logged[3]["program"] | {"sha256": ""} == {"name": "a.ngc", "bytes": 5, "sha256": ""}
    last = bench.logged[-1]
    assert {key: last[key] for key in (*WHO, "cycle", "do", "command", "accepted", "reason")} == {
        **WHO,
        "cycle": 77,
        "do": "command",
        "command": "enable",
        "accepted": False,
        "reason": "not now",
    }
    assert bench.notes[-1] == "anna (operate, 192.0.2.7): enable: refused: not now"
    assert len(bench.notes) == 5


async def test_who_has_control_is_put_on_record_and_nothing_is_done(bench: LocalBench, path: Path) -> None:
    async with connected(path) as client:
        for do in ("take_control", "release_control"):
            assert (await client.ask(do=do))["accepted"]
    assert [entry["do"] for entry in bench.logged] == ["take_control", "release_control"]
    assert bench.notes == [f"anna (operate, 192.0.2.7): {do} control" for do in ("take", "release")]
    assert bench.desk.requests == []


@given(data=st.data())
@settings(max_examples=100, deadline=None)
def test_no_bytes_whatever_make_the_reading_of_a_request_fail(data: st.DataObject) -> None:
    desk = LocalBench().requests
    asked = {"id": 1, "who": WHO, "do": "write_object", "node": 1, "index": 2, "value": 1.5}
    payload = bytearray(json.dumps(asked).encode())
    for _ in range(data.draw(st.integers(0, 6))):
        place = data.draw(st.integers(0, len(payload) - 1))
        payload[place : place + data.draw(st.integers(0, 3))] = data.draw(st.binary(max_size=4)) or b" "
    read = desk.read(bytes(payload))
    if isinstance(read, bytes):
        assert json.loads(read)["refusal"] == "malformed"
    else:
        assert read.model_fields_set >= {"id", "who", "do"}
