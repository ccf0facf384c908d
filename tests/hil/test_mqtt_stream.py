"""The stream of a run over a real broker has the extremes of its recording."""

import asyncio
import struct
from pathlib import Path
from typing import Any

import aiomqtt
import numpy as np
from mosquitto import Mosquitto, needs_mosquitto
from program_steps import circle

from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.recording.reader import Recording, load_recording

ROOT = "servo_ctrl/xy_table"
PROGRAM = circle(2.0, 2000.0, turns=4.0)
HEADER, PAIR = struct.Struct("<4sIIqHH"), struct.Struct("<QII")


async def received(port: int, subscribed: asyncio.Event) -> list[bytes]:
    """Return the stream until the controller goes offline."""
    messages = []
    async with aiomqtt.Client("127.0.0.1", port, max_queued_incoming_messages=10_000) as client:
        await client.subscribe(f"{ROOT}/stream")
        await client.subscribe(f"{ROOT}/online")
        subscribed.set()
        async for message in client.messages:
            if message.topic.value.endswith("/stream"):
                messages.append(bytes(message.payload))
            elif message.payload == b"offline":
                break
    return messages


def compared(messages: list[bytes], recording: Recording) -> int:
    """Compare each pair with the rows of the recording that it decimates; return the number of rows."""
    names = [name for name in recording.columns if name not in {"time_s", "cycle"}]
    cycle = recording.columns["cycle"]
    table = np.column_stack([recording.columns[name] for name in names]).astype(np.float32)
    rows_seen = 0
    for message in messages:
        *_, count, channels = HEADER.unpack_from(message)
        assert channels == len(names)
        for place in range(count):
            at = HEADER.size + place * (PAIR.size + 8 * channels)
            first, span, rows = PAIR.unpack_from(message, at)
            values = np.frombuffer(message, "<f4", 2 * channels, at + PAIR.size).reshape(channels, 2)
            part = table[(cycle >= first) & (cycle < first + span)]
            assert len(part) == rows
            assert np.array_equal(values[:, 0], np.fmin.reduce(part, axis=0), equal_nan=True)
            assert np.array_equal(values[:, 1], np.fmax.reduce(part, axis=0), equal_nan=True)
            rows_seen += rows
    return rows_seen


@needs_mosquitto
async def test_the_stream_has_the_extremes_of_the_recording(bench: Any, tmp_path: Path) -> None:
    async with Mosquitto(tmp_path) as broker:
        mqtt = f"[mqtt]\nport = {broker.port}\nstream = true\nstream_hz = 40.0\n"
        directory = bench.machine({"[machine]": f"{mqtt}[machine]"})
        bench.simulate(directory)
        program = tmp_path / "program.toml"
        program.write_text(PROGRAM, encoding="utf-8")
        machine = load_machine(directory)
        subscribed = asyncio.Event()
        async with asyncio.timeout(120.0):
            listening = asyncio.create_task(received(broker.port, subscribed))
            await subscribed.wait()
            motion = load_program(program, machine)
            report = await run_machine(machine, motion, bench.bus_spec, "lockstep", tmp_path / "r")
            messages = await listening
    assert report.completed
    recording = load_recording(tmp_path / "r")
    sequence = [HEADER.unpack_from(message)[1] for message in messages]
    assert sequence == sorted(sequence)
    dropped = HEADER.unpack_from(messages[-1])[2]
    # messages from before the connection are dropped and counted; later ones are complete
    assert sequence[-1] + 1 - len(sequence) == dropped
    seen = compared(messages, recording)
    assert seen + 100 * dropped == len(recording.columns["cycle"])
    assert seen > 0
