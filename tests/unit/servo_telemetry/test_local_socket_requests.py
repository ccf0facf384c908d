"""Requests over the local socket: executed, refused and logged."""

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from local_socket_bench import WHO, LocalSocketBench, connected

from servo_ctrl.commands.command import Command, CommandRequest, CommandResult, Refusal
from servo_ctrl.commands.local_frames import JSON, frame
from servo_ctrl.telemetry.local_socket.client import MALFORMED_LIMIT


async def test_requests_reach_the_command_handler_and_its_answer_returns(
    bench: LocalSocketBench, path: Path
) -> None:
    async with connected(path) as client:
        assert (await client.ask(do="command", command="enable", axis="x"))["accepted"]
        assert (await client.ask(do="setting", setting="required_m", value=5e-6))["accepted"]
        assert (await client.ask(do="setting", setting="learner", value="screw"))["accepted"]
        assert (await client.ask(do="setting", setting="adaptation", value=True))["accepted"]
        assert (await client.ask(do="jog", axis="y", value=-0.01))["accepted"]
        assert (await client.ask(do="jog_step", axis="x", value=1e-6))["accepted"]
        assert (await client.ask(do="touch_off", axis="x", value=0))["accepted"]
        assert (await client.ask(do="run_line", value="G0 X1"))["accepted"]
        assert (await client.ask(do="clear_counters"))["accepted"]
        program = {"name": "part.toml", "text": "[[step]]"}
        assert (await client.ask(do="load_program", program=program))["accepted"]
        assert (await client.ask(do="read_object", node=1, index=0x6065))["value"] == 1000
        assert (await client.ask(do="write_object", node=1, index=0x6065, value=7))["accepted"]
        bench.handler.verdict = CommandResult(Refusal.WRONG_STATE, "not now")
        refused = await client.ask(do="command", command="home")
    assert (refused["accepted"], refused["refusal"], refused["reason"]) == (False, "wrong_state", "not now")
    assert bench.handler.requests == [CommandRequest(Command.ENABLE, "x"), CommandRequest(Command.HOME, "")]
    assert bench.handler.changes == [("required_m", 5e-6), ("learner", "screw"), ("adaptation", True)]
    assert bench.handler.jogs == [("y", -0.01), ("step x", 1e-6), ("touch off x", 0.0)]
    assert bench.texts == [("line", "G0 X1"), ("part.toml", "[[step]]")]
    assert len(bench.handler.programs) == 2
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
        ({"do": "jog_step", "axis": "x", "value": True}, "malformed"),
        ({"do": "jog_step", "value": 0.001}, "malformed"),
        ({"do": "run_line", "value": 1}, "malformed"),
        ({"do": "read_object", "node": 128, "index": 0}, "malformed"),
        ({"do": "read_object", "node": 1}, "malformed"),
        ({"do": "load_program", "program": {"name": "../evil.toml", "text": ""}}, "malformed"),
        ({"do": "command", "command": "enable", "who": {**WHO, "role": "king"}}, "malformed"),
    ],
)
async def test_an_invalid_request_is_refused_and_not_executed(
    bench: LocalSocketBench, path: Path, fields: dict[str, Any], refusal: str
) -> None:
    async with connected(path) as client:
        answer = await client.ask(**fields)
        assert (answer["accepted"], answer["refusal"]) == (False, refusal)
        assert answer["reason"]
        assert (await client.ask(do="clear_counters"))["accepted"], "it goes on"
    assert (bench.handler.requests, bench.handler.changes, bench.handler.jogs, bench.texts) == (
        [],
        [],
        [],
        [],
    )


@pytest.mark.parametrize("payload", [b"", b"{", b"\xff\xfe", b"[]", b"null", b"NaN", b"[" * 5000])
async def test_bad_json_is_answered_a_few_times_and_then_ends_the_connection(
    bench: LocalSocketBench, path: Path, payload: bytes
) -> None:
    async with connected(path) as client:
        for _ in range(MALFORMED_LIMIT):
            client.send(frame(JSON, payload))
            answer = await client.message("answer")
            assert (answer["id"], answer["refusal"]) == (0, "malformed")
        await client.ends()


async def test_a_stop_does_not_wait_for_an_object_that_is_being_read(
    bench: LocalSocketBench, path: Path
) -> None:
    bench.objects.wait.clear()
    async with connected(path) as client:
        asked = {"id": 1, "who": WHO, "do": "read_object", "node": 1, "index": 0x6065}
        client.send(frame(JSON, json.dumps(asked).encode()))
        asked = {"id": 2, "who": WHO, "do": "command", "command": "quick_stop"}
        client.send(frame(JSON, json.dumps(asked).encode()))
        assert (await client.message("answer"))["id"] == 2
        bench.objects.wait.set()
        assert (await client.message("answer"))["value"] == 1000


async def test_requests_of_a_flood_are_all_answered_in_turn(bench: LocalSocketBench, path: Path) -> None:
    asked = frame(JSON, json.dumps({"id": 1, "who": WHO, "do": "clear_counters"}).encode())
    async with connected(path) as flooder, connected(path) as other:
        flooder.send(asked * 200)
        assert (await other.ask(do="command", command="quick_stop"))["accepted"]
        assert bench.cleared < 200, "the other did not wait for all of them"
        for _ in range(200):
            await flooder.message("answer")
    assert bench.cleared == 200


async def test_log_and_events_name_the_user_of_each_request_and_of_a_jog_only_changes(
    bench: LocalSocketBench, path: Path
) -> None:
    async with connected(path) as client:
        for value in (0.01, 0.01, 0.01, 0.02, 0.0, 0.0):
            await client.ask(do="jog", axis="x", value=value)
        await client.ask(do="load_program", program={"name": "a.ngc", "text": "G0 X1"})
        bench.handler.verdict = CommandResult(Refusal.WRONG_STATE, "not now")
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


async def test_control_changes_are_logged_and_execute_nothing(bench: LocalSocketBench, path: Path) -> None:
    async with connected(path) as client:
        for do in ("take_control", "release_control"):
            assert (await client.ask(do=do))["accepted"]
    assert [entry["do"] for entry in bench.logged] == ["take_control", "release_control"]
    assert bench.notes == [f"anna (operate, 192.0.2.7): {do} control" for do in ("take", "release")]
    assert bench.handler.requests == []


@given(data=st.data())
@settings(max_examples=100, deadline=None)
def test_arbitrary_bytes_never_raise_in_request_parsing(data: st.DataObject) -> None:
    handler = LocalSocketBench().requests
    asked = {"id": 1, "who": WHO, "do": "write_object", "node": 1, "index": 2, "value": 1.5}
    payload = bytearray(json.dumps(asked).encode())
    for _ in range(data.draw(st.integers(0, 6))):
        place = data.draw(st.integers(0, len(payload) - 1))
        payload[place : place + data.draw(st.integers(0, 3))] = data.draw(st.binary(max_size=4)) or b" "
    read = handler.read(bytes(payload))
    if isinstance(read, bytes):
        assert json.loads(read)["refusal"] == "malformed"
    else:
        assert read.model_fields_set >= {"id", "who", "do"}
