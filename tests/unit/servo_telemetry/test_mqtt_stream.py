"""The binary stream of rows: no peak is lost, a loss is counted, and the documented decoder reads it."""

import asyncio
import contextlib
import itertools
import json
import math
import random
import re
import signal
import struct
import sys
from pathlib import Path
from typing import Any

import pytest
from fake_command_handler import FakeCommandHandler
from mosquitto import LIMIT_S, Mosquitto, needs_mosquitto
from mqtt_bench import ROOT, running, until

from servo_ctrl.config.mqtt_model import MqttConfig
from servo_ctrl.recording.channels import channels_of
from servo_ctrl.telemetry.mqtt.service import MqttLink
from servo_ctrl.telemetry.mqtt.stream import WAITING, RowStream

AXES = ("x", "y")
NAMES = [channel.name for channel in channels_of(AXES)]
DOCUMENT = Path(__file__).parents[3] / "docs" / "mqtt.md"


def row(cycle: int, **values: float) -> list[float]:
    """A row of the recording; `x__position_error_m` is the channel x.position_error_m."""
    filled = dict.fromkeys(NAMES, 0.0) | {"time_s": cycle * 1e-3, "cycle": float(cycle)}
    filled |= {name.replace("__", "."): value for name, value in values.items()}
    return [filled[name] for name in NAMES]


def decoded(message: bytes) -> tuple[dict[str, int], list[dict[str, Any]]]:
    """By the table of docs/mqtt.md, written down once more."""
    assert message[:4] == b"SCR1"
    (sequence, dropped), (time_us,) = (
        struct.unpack_from("<II", message, 4),
        struct.unpack_from("<q", message, 12),
    )
    count, channels = struct.unpack_from("<HH", message, 20)
    found, size = [], 16 + 8 * channels
    assert len(message) == 24 + count * size
    for at in range(24, len(message), size):
        cycle, cycles, rows = struct.unpack_from("<QII", message, at)
        values = struct.unpack_from(f"<{2 * channels}f", message, at + 16)
        found.append({"cycle": cycle, "cycles": cycles, "rows": rows, "values": values})
    return {"sequence": sequence, "dropped": dropped, "time_us": time_us}, found


def extremes(pair: dict[str, Any], name: str) -> tuple[float, float]:
    place = NAMES.index(name) - 2  # without time and cycle
    least, greatest = pair["values"][2 * place : 2 * place + 2]
    return least, greatest


@pytest.mark.parametrize("stream_hz", [7.0, 100.0, 1000.0])
async def test_no_peak_is_lost(stream_hz: float) -> None:
    stream, draw = RowStream(AXES, 1e-3, stream_hz), random.Random(1)
    errors = [draw.gauss(0.0, 1e-6) for _ in range(1500)]
    errors[777] = 5e-4
    for cycle, error_m in enumerate(errors):
        stream.take(row(cycle, x__position_error_m=error_m))
    pairs = []
    while stream._full:
        pairs += decoded(await stream.next_message())[1]
    if rest := stream.rest():
        pairs += decoded(rest)[1]
    assert [pair["cycle"] for pair in pairs] == list(range(0, 1500, stream.rows_a_pair))
    assert sum(pair["rows"] for pair in pairs) == 1500
    for pair in pairs:
        part = errors[pair["cycle"] : pair["cycle"] + pair["rows"]]
        assert extremes(pair, "x.position_error_m") == pytest.approx((min(part), max(part)), rel=1e-6)
        assert extremes(pair, "y.position_error_m") == (0.0, 0.0)
    assert max(extremes(pair, "x.position_error_m")[1] for pair in pairs) == pytest.approx(5e-4)


async def test_a_missing_value_hides_no_present_one() -> None:
    stream = RowStream(AXES, 1e-3, 100.0)
    for cycle in range(100):
        there = cycle < 10 or (cycle < 20 and cycle % 3 == 0)
        stream.take(row(cycle, x__scale_position_m=cycle * 1e-3 if there else math.nan))
    _, pairs = decoded(await stream.next_message())
    assert extremes(pairs[0], "x.scale_position_m") == pytest.approx((0.0, 9e-3))
    assert extremes(pairs[1], "x.scale_position_m") == pytest.approx((12e-3, 18e-3))
    assert all(map(math.isnan, extremes(pairs[2], "x.scale_position_m")))


async def test_missed_ticks_show_in_the_cycles_of_a_pair() -> None:
    stream = RowStream(AXES, 1e-3, 100.0)
    for number in range(100):
        stream.take(row(number if number < 15 else number + 4))
    _, pairs = decoded(await stream.next_message())
    assert [(pair["cycle"], pair["cycles"], pair["rows"]) for pair in pairs[:3]] == [
        (0, 10, 10),
        (10, 14, 10),
        (24, 10, 10),
    ]


async def test_undelivered_messages_are_dropped_oldest_first_and_counted() -> None:
    stream = RowStream(AXES, 1e-3, 100.0)
    for cycle in range(100 * (WAITING + 5)):
        stream.take(row(cycle))
    header, pairs = decoded(await stream.next_message())
    assert (header["sequence"], header["dropped"], pairs[0]["cycle"]) == (5, 5, 500)
    stream.discard()
    assert stream.dropped == 5 + WAITING - 1


async def test_many_axes_make_more_messages_not_larger_ones() -> None:
    axes = tuple("abcdefgh")
    stream = RowStream(axes, 1e-3, 1000.0)
    for cycle in range(200):
        stream.take([0.0, float(cycle), *[0.0] * (len(channels_of(axes)) - 2)])
    first = await stream.next_message()
    assert 16_000 < len(first) <= 32_768
    assert decoded(await stream.next_message())[1][0]["cycle"] == len(decoded(first)[1])


def streaming_link(
    broker: Mosquitto, handler: FakeCommandHandler, stream_hz: float
) -> tuple[MqttLink, RowStream]:
    config = MqttConfig.model_validate({"port": broker.port, "stream": True, "stream_hz": stream_hz})
    stream = RowStream(AXES, 1e-3, config.stream_hz)
    return MqttLink(config, "xy_table", handler, stream), stream


async def peaks_at(stream: RowStream, phase: int) -> None:
    """Rows without end; the error of every hundredth is a peak."""
    for cycle in itertools.count():
        stream.take(row(cycle, x__position_error_m=5e-4 if cycle % 100 == phase else -1e-6))
        if cycle % 100 == 99:
            await asyncio.sleep(0.01)


@needs_mosquitto
async def test_the_decoder_of_the_document_reads_what_a_broker_delivers(
    broker: Mosquitto, handler: FakeCommandHandler, tmp_path: Path
) -> None:
    (code,) = re.findall(r"<!-- decoder -->\n```python\n(.*?)```", DOCUMENT.read_text("utf-8"), re.DOTALL)
    script = tmp_path / "decoder.py"
    script.write_text(code, encoding="utf-8")
    link, stream = streaming_link(broker, handler, 50.0)
    async with running(link):
        await until(lambda: link.problem == "")
        async with broker.listener(f"{ROOT}/stream/channels") as listener:
            description = (await listener.until("/stream/channels")).content
        decoder = await asyncio.create_subprocess_exec(
            *(sys.executable, str(script), "127.0.0.1", str(broker.port), ROOT, "x.position_error_m"),
            stdout=asyncio.subprocess.PIPE,
        )
        assert decoder.stdout is not None
        feeding = asyncio.create_task(peaks_at(stream, 33))
        try:
            async with asyncio.timeout(LIMIT_S):
                lines = [(await decoder.stdout.readline()).split() for _ in range(15)]
        finally:
            feeding.cancel()
            decoder.kill()
            await decoder.communicate()
    assert description["rows_a_pair"] == 20
    assert [entry["name"] for entry in description["channels"]] == NAMES[2:]
    first = int(lines[0][0])
    for place, (start, least, greatest) in enumerate(lines):
        assert int(start) == first + 20 * place
        assert float(least) == pytest.approx(-1e-6)
        assert float(greatest) == pytest.approx(5e-4 if int(start) % 100 == 20 else -1e-6)


async def sent_at_once(stream: RowStream) -> bool:
    """Whether all that waits is on its way soon."""
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(0.5):
            while stream._full:  # noqa: ASYNC110  # the stream wakes only senders
                await asyncio.sleep(0)
    return not stream._full


@needs_mosquitto
async def test_a_broker_that_hangs_costs_messages_and_the_stream_goes_on_with_it(
    broker: Mosquitto, handler: FakeCommandHandler
) -> None:
    link, stream = streaming_link(broker, handler, 1000.0)
    async with running(link):
        await until(lambda: link.problem == "")
        broker.signal(signal.SIGSTOP)
        try:
            messages = 0
            while await sent_at_once(stream):  # until what lies between us and the broker is full
                for _ in range(100):
                    stream.take(row(messages))
                messages += 1
                assert messages < 20_000
            assert stream.dropped == 0
            for _ in range(100 * (WAITING - 1 + 5)):  # one waits already
                stream.take(row(messages))
            assert stream.dropped == 5
        finally:
            broker.signal(signal.SIGCONT)
        await until(lambda: link.problem == "" and not stream._full)
        for _ in range(100):
            stream.take(row(messages))
        await until(lambda: not stream._full)


@needs_mosquitto
async def test_without_the_key_nothing_is_streamed(broker: Mosquitto, handler: FakeCommandHandler) -> None:
    link = MqttLink(MqttConfig.model_validate({"port": broker.port}), "xy_table", handler)
    async with running(link):
        await until(lambda: link.problem == "")
        async with broker.listener(f"{ROOT}/#") as listener:
            await listener.until("/state")
            assert not [message for message in listener.received if "/stream" in message.topic]


def test_the_description_is_the_example_of_the_document_but_for_length() -> None:
    description = json.loads(RowStream(AXES, 1e-3, 100.0).description())
    assert description["channels"][:2] == [
        {"name": "segment", "unit": "1"},
        {"name": "x.position_command_m", "unit": "m"},
    ]
    assert (description["format"], description["period_s"], description["rows_a_pair"]) == (1, 1e-3, 10)
