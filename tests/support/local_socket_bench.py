"""The real server of the local socket with a fake command handler, and a raw client."""

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Callable, Generator
from pathlib import Path
from typing import Any

import numpy as np
from fake_command_handler import FakeCommandHandler

from servo_ctrl.commands.client_activity import ClientActivity
from servo_ctrl.commands.local_frames import JSON, MESSAGE_LIMIT, frame, read_frame, row_block
from servo_ctrl.commands.local_messages import (
    AxisInfo,
    ChannelInfo,
    Hello,
    ProgramText,
    TuningRun,
    message_json,
    plain_json,
)
from servo_ctrl.config.part_program import PartProgram
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.telemetry.local_socket.requests import LocalRequests, Outcome, RequestTargets
from servo_ctrl.telemetry.local_socket.rows import RowBuffer
from servo_ctrl.telemetry.local_socket.server import LocalServer
from servo_ctrl.telemetry.local_socket.status import BusFigures, StatusEncoder

LIMIT_S = 10.0
CHANNELS = ("time_s", "cycle", "x.position_command_m")
WHO = {"user": "anna", "role": "operate", "address": "192.0.2.7"}
BUS = {
    "load": 0.5,
    "bit_rate": 1_000_000,
    "frames_per_s": 7000.0,
    "cycle_us": {"edges_us": [900.0, 1100.0], "counts": [0, 10, 0]},
    "missed_ticks": 0,
    "missing_inputs": 0,
}


class FakeObjects:
    """Objects of nodes; reading and writing wait until `wait` is set."""

    def __init__(self) -> None:
        self.values: dict[tuple[int, int, int], int | float | str] = {(1, 0x6065, 0): 1000}
        self.wait = asyncio.Event()
        self.wait.set()

    async def read(self, node: int, index: int, subindex: int) -> Outcome:
        await self.wait.wait()
        return Outcome(value=self.values[node, index, subindex])

    async def write(self, node: int, index: int, subindex: int, value: float | str | bool) -> Outcome:
        await self.wait.wait()
        self.values[node, index, subindex] = value
        return Outcome()


class LocalSocketBench:
    """`server` with the fakes that it uses."""

    def __init__(self, machine_sha256: str = "") -> None:
        self.handler = FakeCommandHandler()
        self.objects = FakeObjects()
        self.rows = RowBuffer(len(CHANNELS), 512)
        self.logged: list[dict[str, Any]] = []
        self.notes: list[str] = []
        self.texts: list[tuple[str, str]] = []
        self.cleared = 0
        self.tuning_runs: list[TuningRun] = []
        self.tuning_may_end: Callable[[ClientActivity], bool] = lambda _activity: True
        self.encoder = StatusEncoder()
        self.requests = LocalRequests(
            RequestTargets(
                commands=self.handler,
                objects=self.objects,
                read_program=self._read_program,
                read_line=self._read_line,
                tuning_run=self._tuning_run,
                clear_counters=self._clear,
                log=self.logged.append,
                note=self.notes.append,
                cycle=lambda: 77,
            )
        )
        hello = Hello(
            machine="bench",
            period_s=1e-3,
            axes=(AxisInfo(name="x", travel_m=(-0.1, 0.1), velocity_m_s=0.2),),
            channels=tuple(ChannelInfo(name=name, unit="1", meaning="") for name in CHANNELS),
            nodes=(),
            machine_file="controller.toml",
            learned_dir="learned",
            record_dir=None,
            pid=1,
            machine_sha256=machine_sha256,
        )
        self.server = LocalServer(message_json("hello", hello), self.requests, self.rows, self.status)

    def status(self) -> Generator[None, None, bytes]:
        figures = BusFigures(plain_json(BUS), b"[]", b"[]", b"[]")
        return (yield from self.encoder.pieces(self.handler.status(), figures))

    def cycle(self, count: int = 1) -> None:
        """Append rows, then send the pulse that flushes them."""
        for _ in range(count):
            number = float(self.rows.end)
            self.rows.take([number * 1e-3, number, 2.0 * number])
        self.server.pulse()

    async def _read_program(self, program: ProgramText) -> ProgramConfig:
        self.texts.append((program.name, program.text))
        return ProgramConfig.model_construct(steps=[], source=program.name)

    async def _read_line(self, line: str) -> PartProgram:
        self.texts.append(("line", line))
        return PartProgram.model_construct(steps=[], source="line")

    async def _tuning_run(self, asked: TuningRun, activity: ClientActivity) -> Outcome:
        self.tuning_runs.append(asked)
        async with asyncio.timeout(LIMIT_S):
            while not self.tuning_may_end(activity):  # noqa: ASYNC110  # bounded, and short
                await asyncio.sleep(0.001)
        return Outcome(value="recording")

    def _clear(self) -> None:
        self.cleared += 1


class RawClient:
    """Sends raw bytes and reads frame by frame."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.reader, self.writer = reader, writer
        self._id = 0

    async def message(self, kind: str | None = None) -> dict[str, Any]:
        """Return the next JSON message of this kind; skip others."""
        async with asyncio.timeout(LIMIT_S):
            while True:
                letter, payload = await read_frame(self.reader, MESSAGE_LIMIT)
                if letter == JSON:
                    found: dict[str, Any] = json.loads(payload)
                    if kind in {None, found["kind"]}:
                        return found

    async def rows(self) -> tuple[int, int, np.ndarray[Any, np.dtype[np.float64]]]:
        """Return the next rows: number of the first, missed ones, values."""
        async with asyncio.timeout(LIMIT_S):
            while True:
                letter, payload = await read_frame(self.reader, MESSAGE_LIMIT)
                if letter != JSON:
                    block = row_block(payload, len(CHANNELS))
                    return block.first, block.missed, block.values

    def send(self, data: bytes) -> None:
        self.writer.write(data)

    async def ask(self, **fields: Any) -> dict[str, Any]:
        """Send a request and read its answer."""
        self._id += 1
        request = {"kind": "request", "id": self._id, "who": WHO, **fields}
        self.send(frame(JSON, json.dumps(request).encode()))
        answer = await self.message("answer")
        assert answer["id"] in {self._id, 0}
        return answer

    async def ends(self) -> None:
        """Wait until the server closes the connection; remaining data are skipped."""
        async with asyncio.timeout(LIMIT_S):
            with contextlib.suppress(ConnectionError):
                while await self.reader.read(65536):
                    pass


@contextlib.asynccontextmanager
async def connected(path: Path) -> AsyncIterator[RawClient]:
    """A client that has read the greeting."""
    reader, writer = await asyncio.open_unix_connection(str(path))
    client = RawClient(reader, writer)
    try:
        yield client
    finally:
        writer.close()
        with contextlib.suppress(ConnectionError):
            await writer.wait_closed()
