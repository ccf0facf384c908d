"""The real controller in lockstep, monitored and commanded by MQTT with Mosquitto's own clients."""

import signal
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest_asyncio
from mosquitto import Listener, Message, Mosquitto, needs_mosquitto
from program_steps import circle

pytestmark = needs_mosquitto
ROOT = "servo_ctrl/xy_table"
PROGRAM = circle(10.0, 3000.0, turns=2.0)


@pytest_asyncio.fixture
async def broker(tmp_path: Path) -> AsyncIterator[Mosquitto]:
    async with Mosquitto(tmp_path) as made:
        yield made


def controller(bench: Any, broker: Mosquitto, *options: str) -> Any:
    """Start simulator and controller as processes; returns that of the controller."""
    machine = bench.machine({})
    bench.simulate(machine)
    command = ["run", "--machine", str(machine), "--bus", bench.bus_spec, "--pacing", "lockstep"]
    return bench.run("servo-ctrl", *command, "--mqtt", f"127.0.0.1:{broker.port}", *options)


async def command(broker: Mosquitto, listener: Listener, request_id: str, content: str) -> dict[str, Any]:
    """Send a command; return its acknowledgement."""
    await broker.publish(f"{ROOT}/command", f'{{"id": "{request_id}", {content}}}')
    ack = await listener.until("/command/ack", lambda message: message.content["id"] == request_id)
    assert ack.qos == 1
    return ack.content


async def test_learning_is_started_watched_and_aborted(bench: Any, broker: Mosquitto) -> None:
    process = controller(bench, broker)
    async with broker.listener(f"{ROOT}/#") as listener:
        await listener.until("/state", lambda state: state.content["stage"] == "ready")
        start = await command(broker, listener, "1", '"command": "start_learning", "axis": "x"')
        assert start["accepted"], start
        again = await command(broker, listener, "2", '"command": "start_learning", "axis": "x"')
        assert (again["accepted"], again["refusal"]) == (False, "wrong_state")
        assert again["reason"]
        unknown = await command(broker, listener, "3", '"command": "start_learning", "axis": "w"')
        assert unknown["refusal"] == "unknown"

        def is_learning(state: Message) -> bool:
            learning = state.content["learning"]
            return learning["state"] == "running" and learning.get("strokes_done", 0) > 0

        learning = (await listener.until("/state", is_learning)).content["learning"]
        assert learning["axis"] == "x"
        assert 0.0 < learning["progress"] < 1.0
        assert learning["remaining_s"] > 0.0
        assert (await command(broker, listener, "4", '"command": "abort_learning"'))["accepted"]
        await listener.until("/state", lambda state: state.content["learning"]["state"] == "aborted")
        process.send_signal(signal.SIGTERM)
        await listener.until("/online", lambda online: online.payload == "offline")


async def test_production_publishes_reversals_and_learning_due(
    bench: Any, broker: Mosquitto, tmp_path: Path
) -> None:
    program = tmp_path / "round.toml"
    program.write_text(PROGRAM, encoding="utf-8")
    async with broker.listener(f"{ROOT}/#") as listener:
        controller(bench, broker, "--serve", "--program", str(program))

        def has_run(state: Message) -> bool:
            return state.content["stage"] == "ready" and state.content["axis"]["x"]["reversals"] > 0

        await listener.until("/state", has_run)
        lowered = await command(broker, listener, "1", '"setting": "required_um", "value": 0.5')
        assert lowered["accepted"], lowered
        beyond = await command(broker, listener, "2", '"setting": "required_um", "value": -1')
        assert (beyond["accepted"], beyond["refusal"]) == (False, "out_of_range")
        assert (await command(broker, listener, "3", '"command": "start_program"'))["accepted"]
        await listener.until("/axis/x/learning_due", lambda message: message.content["due"])
        reversals = [message.content for message in listener.received if message.topic.endswith("/reversal")]
    assert len(reversals) >= 4
    assert all(report["error_mean_um"] > 0.5 for report in reversals)
    async with broker.listener(f"{ROOT}/#") as late:
        # A state retained just before "due" may come first
        state = await late.until("/state", lambda message: message.content["axis"]["x"]["learning_due"])
        assert state.content["settings"]["required_um"] == 0.5
