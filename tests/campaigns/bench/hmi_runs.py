"""One run of `make bench-hmi`: the circle at 1 kHz with somebody looking on, and what it cost."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
import sys
import tempfile
import time
from collections import Counter
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any, NamedTuple

from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.daemon.page.page_process import PageOptions, kept_running
from servo_ctrl.daemon.run.report import Progress, RunReport
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.recording.reader import load_recording
from tests.campaigns.bench.cyclictest import percentile_us
from tests.support.free_port import free_tcp_port

HERE = Path(__file__).parent
MACHINE = HERE.parents[2] / "machines" / "xy_table"
PROGRAM = HERE / "circle.toml"
PAGES = 10
PATHS = ("/scope", "/contour", "/", "/motion", "/bus")
SHARES = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999}
VARIANTS = ("without", "page", f"{PAGES} pages", "never reads")
READ_LIMIT_S = 60.0
FRAME = struct.Struct("<cI")
ROWS = struct.Struct("<IQQ")


class Run(NamedTuple):
    """One run, or several of a kind. Nothing is left out: what was stopped early is counted too."""

    lateness: Counter[int]
    """Whole microseconds -> ticks."""
    served: int
    missed: int
    missing_inputs: int
    stopped: int
    cycles: int
    """Of the part in which `processor_s` was taken."""
    processor_s: float
    """Of the control process, the socket's work with it."""
    updates: int
    """Of all pages."""

    def __add__(self, other: Run) -> Run:  # type: ignore[override]  # not the sum of tuples
        return Run(*(mine + theirs for mine, theirs in zip(self, other, strict=True)))

    def as_json(self) -> dict[str, Any]:
        return {
            "lateness_us": {name: percentile_us(self.lateness, share) for name, share in SHARES.items()},
            "ticks": self.served,
            "missed": self.missed,
            "missed_of_10000": 1e4 * self.missed / max(self.missed + self.served, 1),
            "missing_inputs": self.missing_inputs,
            "stopped_runs": self.stopped,
            "processor_us_per_cycle": self.processor_us,
            "updates": self.updates,
        }

    @property
    def processor_us(self) -> float:
        return 1e6 * self.processor_s / max(self.cycles, 1)


class Processor:
    """Processor time of our process while the program runs, by the progress of the run."""

    def __init__(self) -> None:
        self.first: tuple[int, float] | None = None
        self.last = (0, 0.0)

    def __call__(self, progress: Progress) -> None:
        if progress.stage is Stage.RUNNING:
            self.last = progress.cycle, time.process_time()
            self.first = self.first or self.last

    @property
    def cost(self) -> tuple[int, float]:
        """Cycles and seconds."""
        begun = self.first or self.last
        return self.last[0] - begun[0], self.last[1] - begun[1]


class Counts(NamedTuple):
    """The rows of a run, by who has counted them."""

    cycles: int
    missed_ticks: int
    recorded: int
    received: int
    """By a client from its first row on."""
    first: int
    told_missed: int

    @property
    def agree(self) -> bool:
        ticks = self.cycles - self.missed_ticks
        return self.recorded == ticks == self.first + self.received + self.told_missed


class Bench:
    """The table on its bus, and who looks on."""

    def __init__(self, bus: str, folder: Path) -> None:
        self._bus, self._folder = bus, folder
        self._socket = folder / "page.sock"
        """A link to that of the run that is going on: the page's process outlives the runs."""
        self._pages: asyncio.subprocess.Process | None = None

    @contextlib.asynccontextmanager
    async def around(self, variant: str) -> AsyncIterator[None]:
        """The page's process and its pages, as the variant has them."""
        if variant not in {"page", VARIANTS[2]}:
            yield
            return
        address = f"127.0.0.1:{free_tcp_port()}"
        page = [sys.executable, "-m", "servo_ctrl.hmi", "serve", "--socket", str(self._socket)]
        count = PAGES if variant == VARIANTS[2] else 0
        async with kept_running([*page, "--listen", address, "--recordings", str(self._folder)], print):
            self._pages = await asyncio.create_subprocess_exec(
                *("nice", sys.executable, "-m", "tests.campaigns.bench.hmi_pages"),
                *(f"http://{address}", str(count), *PATHS),
                stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE,
            )
            try:
                answer = await self._line()
                if answer != "open":
                    raise RuntimeError(f"the pages did not open: {answer}")
                yield
            finally:
                if self._pages.returncode is None:
                    self._pages.terminate()
                    await self._pages.wait()
                self._pages = None

    async def run(self, variant: str, *, fifo: bool) -> Run:
        """The circle once, recorded."""
        idle = socket.socket(socket.AF_UNIX) if variant == "never reads" else None

        def on_socket(path: Path) -> None:
            self._socket.unlink(missing_ok=True)
            self._socket.symlink_to(path)
            if idle is not None:
                idle.connect(str(path))

        processor = Processor()
        await self._updates()
        page = None if variant == "without" else PageOptions(None, on_socket)
        try:
            report, _ = await self._circle(processor, page, fifo=fifo)
        finally:
            if idle is not None:
                idle.close()
        assert report.lateness is not None  # of a run in real time
        lateness = Counter({us: ticks for us, ticks in enumerate(report.lateness._counts) if ticks})
        cycles, processor_s = processor.cost
        return Run(
            lateness,
            report.lateness.count,
            report.missed_ticks,
            report.missing_inputs,
            int(not report.completed),
            cycles,
            processor_s,
            await self._updates(),
        )

    async def counts(self) -> Counts:
        """A run whose rows are counted by a client that reads everything, in a thread of its own."""
        reader: asyncio.Task[tuple[int, int, int]] | None = None

        def on_socket(path: Path) -> None:
            nonlocal reader
            connection = socket.socket(socket.AF_UNIX)
            connection.settimeout(READ_LIMIT_S)
            connection.connect(str(path))
            reader = asyncio.create_task(asyncio.to_thread(_read_rows, connection))

        report, recorded = await self._circle(Processor(), PageOptions(None, on_socket), fifo=False)
        assert reader is not None
        first, received, missed = await reader
        return Counts(report.cycles, report.missed_ticks, recorded, received, first, missed)

    async def _circle(
        self, processor: Processor, page: PageOptions | None, *, fifo: bool
    ) -> tuple[RunReport, int]:
        """The report, and how many rows were recorded."""
        machine = load_machine(MACHINE)
        with tempfile.TemporaryDirectory(prefix="bench-") as folder:
            recording = Path(folder) / "recording"
            report = await run_machine(
                machine,
                load_program(PROGRAM, machine),
                self._bus,
                "realtime",
                recording,
                processor,
                fifo=fifo,
                learned_dir=Path(folder) / "learned",
                page=page,
            )
            return report, len(load_recording(recording).columns["cycle"])

    async def _updates(self) -> int:
        """Of all pages since the last question."""
        if self._pages is None or self._pages.stdin is None:
            return 0
        self._pages.stdin.write(b"\n")
        await self._pages.stdin.drain()
        return int(await self._line())

    async def _line(self) -> str:
        assert self._pages is not None
        assert self._pages.stdout is not None
        async with asyncio.timeout(READ_LIMIT_S):
            return (await self._pages.stdout.readline()).decode().strip()


def _read_rows(connection: socket.socket) -> tuple[int, int, int]:
    """Number of the first row, rows, and rows missed as the server told, until the connection ends."""
    first, received, missed = -1, 0, 0
    with connection, connection.makefile("rb") as stream:
        while len(head := stream.read(FRAME.size)) == FRAME.size:
            kind, length = FRAME.unpack(head)
            payload = stream.read(length)
            if kind == b"R" and len(payload) == length:
                rows, number, missed = ROWS.unpack_from(payload)
                first = number if first < 0 else first
                received += rows
    return first, received, missed
