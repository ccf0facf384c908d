"""The MQTT link with a real broker, Mosquitto's command line clients on the other side."""

import asyncio

import pytest
from fake_command_handler import LEARNED, OUTLOOK, REVERSAL, FakeCommandHandler
from mosquitto import Mosquitto, needs_mosquitto
from mqtt_bench import ALL, COMMAND, ROOT, link_to, running, until

from servo_ctrl.commands.command import Command, CommandRequest, CommandResult, Refusal
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.stage import Stage

pytestmark = needs_mosquitto


async def test_a_late_subscriber_finds_the_whole_state(
    broker: Mosquitto, handler: FakeCommandHandler
) -> None:
    handler.set_learning("x", LearningState.RUNNING, OUTLOOK)
    handler.set_axis(0, version=3, learned_at="2026-11-20T09:00:00+00:00", learned=LEARNED, last=REVERSAL)
    handler.set_axis(1, learning_due=True)
    link = link_to(broker, handler)
    async with running(link):
        await until(lambda: link.problem == "")
        async with broker.listener(ALL) as first:
            await first.until("/state")
        async with broker.listener(ALL) as late:
            state = await late.until("/state")
            messages = {message.topic.removeprefix(ROOT): message for message in late.received}
    assert all(message.retained for message in messages.values())
    assert messages["/online"].payload == "online"
    assert not messages["/axis/x/learning_due"].content["due"]
    assert messages["/axis/y/learning_due"].content["due"]
    assert messages["/axis/y/learned"].content["functions"] is None
    functions = messages["/axis/x/learned"].content["functions"]
    assert functions["durations"][0] == {"acceleration_mm_s2": 2.0, "duration_ms": 150.0}
    assert state.content["learning"]["state"] == "running"
    assert state.content["learning"]["progress"] == 0.25
    assert state.content["axis"]["x"]["error_mean_um"] == 2.4
    assert state.content["axis"]["x"]["version"] == 3


async def test_a_change_is_published(broker: Mosquitto, handler: FakeCommandHandler) -> None:
    link = link_to(broker, handler)
    async with running(link), broker.listener(ALL) as listener:
        await listener.until("/state", lambda state: state.content["stage"] == "ready")
        handler.now = handler.now._replace(stage=Stage.RUNNING)
        link.changed()
        await listener.until("/state", lambda state: state.content["stage"] == "running")
        link.due("y", True)
        due = await listener.until("/axis/y/learning_due")
        assert due.content["due"]
        assert due.qos == 1
        handler.set_axis(1, version=1, learned=LEARNED)
        link.changed()
        learned = await listener.until("/axis/y/learned")
        assert learned.content["version"] == 1


async def test_many_changes_are_published_as_few_and_the_last_one_always(
    broker: Mosquitto, handler: FakeCommandHandler
) -> None:
    link = link_to(broker, handler)
    async with running(link), broker.listener(f"{ROOT}/state") as listener:
        await listener.until("/state")
        for cycle in range(1, 501):
            handler.now = handler.now._replace(cycles=cycle)
            link.changed()
            await asyncio.sleep(0)
        await listener.until("/state", lambda state: state.content["cycle"] == 500)
    assert len(listener.received) < 10


async def test_every_reversal_is_published(broker: Mosquitto, handler: FakeCommandHandler) -> None:
    link = link_to(broker, handler)
    async with running(link), broker.listener(f"{ROOT}/axis/+/reversal") as listener:
        await until(lambda: link.problem == "")
        for number in range(20):
            link.reversal("xy"[number % 2], REVERSAL._replace(cycle=number))
        last = await listener.until("/axis/y/reversal", lambda message: message.content["cycle"] == 19)
    assert [message.content["cycle"] for message in listener.received] == list(range(20))
    assert {key: value for key, value in last.content.items() if key not in {"time", "cycle"}} == {
        "direction": -1,
        "acceleration_mm_s2": 27.8,
        "contour_peak_um": 6.3,
        "error_peak_um": 7.2,
        "error_rms_um": 3.1,
        "error_mean_um": 2.4,
    }


async def test_a_command_is_carried_out_and_acknowledged(
    broker: Mosquitto, handler: FakeCommandHandler
) -> None:
    handler.now = handler.now._replace(cycles=1234)
    async with running(link_to(broker, handler)), broker.listener(ALL) as listener:
        await listener.until("/online")
        await broker.publish(COMMAND, '{"id": "7", "command": "start_learning", "axis": "x"}')
        ack = await listener.until("/command/ack")
        await broker.publish(COMMAND, '{"id": "8", "setting": "required_um", "value": 3.5}')
        second = await listener.until("/command/ack")
    assert handler.requests == [CommandRequest(Command.START_LEARNING, "x")]
    assert handler.changes == [("required_m", pytest.approx(3.5e-6))]
    assert ack.qos == 1
    assert not ack.retained
    messages = {key: value for key, value in ack.content.items() if key != "time"}
    assert messages == {"cycle": 1234, "id": "7", "accepted": True, "refusal": "none", "reason": ""}
    assert second.content["id"] == "8"
    assert second.content["accepted"]


async def test_a_refusal_is_answered_over_mqtt_with_its_reason(
    broker: Mosquitto, handler: FakeCommandHandler
) -> None:
    handler.verdict = CommandResult(Refusal.WRONG_STATE, "the machine moves")
    async with running(link_to(broker, handler)), broker.listener(ALL) as listener:
        await listener.until("/online")
        await broker.publish(COMMAND, '{"id": "7", "command": "start_learning"}')
        ack = await listener.until("/command/ack")
    assert not ack.content["accepted"]
    assert ack.content["refusal"] == "wrong_state"
    assert ack.content["reason"] == "the machine moves"


@pytest.mark.parametrize(
    ("payload", "refusal", "reason"),
    [
        (b"start_learning", "malformed", "not JSON"),
        (b"\xff\xfe", "malformed", "not UTF-8 at byte 0"),
        (b'{"id": "1", "command": "abort_learning", "x": "' + b"x" * 4100 + b'"}', "malformed", "4096"),
        (b'{"id": "1", "command": "fly"}', "unknown", "start_learning, abort_learning"),
    ],
)
async def test_bad_input_is_refused_with_its_reason(
    broker: Mosquitto, handler: FakeCommandHandler, payload: bytes, refusal: str, reason: str
) -> None:
    async with running(link_to(broker, handler)), broker.listener(ALL) as listener:
        await listener.until("/online")
        await broker.publish(COMMAND, payload)
        ack = await listener.until("/command/ack")
    assert not ack.content["accepted"]
    assert ack.content["refusal"] == refusal
    assert reason in ack.content["reason"]
    assert handler.requests == []


async def test_a_command_that_the_broker_has_kept_is_never_carried_out(
    broker: Mosquitto, handler: FakeCommandHandler
) -> None:
    await broker.publish(COMMAND, '{"id": "old", "command": "start_learning"}', "-r")
    async with broker.listener(f"{ROOT}/command/ack") as listener, running(link_to(broker, handler)):
        ack = await listener.until("/command/ack")
        assert (ack.content["id"], ack.content["refusal"]) == ("old", "stale")
        await broker.publish(COMMAND, '{"id": "new", "command": "start_learning"}', "-r")
        ack = await listener.until("/command/ack")
        assert (ack.content["id"], ack.content["refusal"]) == ("new", "stale")
        await broker.publish(COMMAND, "", "-r")  # deletes it
        await broker.publish(COMMAND, '{"id": "now", "command": "start_learning"}')
        ack = await listener.until("/command/ack")
        assert (ack.content["id"], ack.content["refusal"]) == ("now", "none")
    assert len(handler.requests) == 1


async def test_a_command_sent_without_a_listener_is_not_delivered_later(
    broker: Mosquitto, handler: FakeCommandHandler
) -> None:
    async with running(link_to(broker, handler)), broker.listener(ALL) as listener:
        await listener.until("/online")
    await broker.publish(COMMAND, '{"id": "1", "command": "start_learning"}')
    async with running(link_to(broker, handler)), broker.listener(ALL) as listener:
        await listener.until("/state")
        await broker.publish(COMMAND, '{"id": "2", "command": "abort_learning"}')
        await listener.until("/command/ack", lambda ack: ack.content["id"] == "2")
    assert handler.requests == [CommandRequest(Command.ABORT_LEARNING)]


async def test_the_same_command_twice_is_answered_twice_and_done_once(
    broker: Mosquitto, handler: FakeCommandHandler
) -> None:
    async with running(link_to(broker, handler)), broker.listener(ALL) as listener:
        await listener.until("/online")
        acks = []
        for _ in range(2):
            await broker.publish(COMMAND, '{"id": "7", "command": "roll_back", "axis": "y"}')
            acks.append((await listener.until("/command/ack")).content)
    assert [ack["accepted"] for ack in acks] == [True, True]
    assert handler.requests == [CommandRequest(Command.ROLL_BACK, "y")]
