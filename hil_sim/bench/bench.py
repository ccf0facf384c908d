"""`with hil_sim.Bench("xy_table") as bench:` starts a simulated machine with its own bus as a process."""

import contextlib
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Literal, Self

from shipped_files import shipped

START_LIMIT_S, STOP_LIMIT_S = 120.0, 10.0
"""Bound the durations of start and stop, s; the first start compiles the plant's kernels. Chosen."""
READY = "on the bus"
"""Part of the line that the simulator prints once its nodes answer."""


class BenchError(RuntimeError):
    """The simulator did not start; the message contains its output."""


class Bench:
    """A simulated machine on its own bus during a `with` block.

    `machine`: a directory with plant.toml, a plant file, or the name of a shipped machine. With
    "lockstep" each SYNC on the bus advances simulated time, with "realtime" the wall clock does. `faults`
    are those of `hil-sim run --fault`.
    """

    def __init__(
        self,
        machine: Path | str,
        *,
        pacing: Literal["lockstep", "realtime"] = "lockstep",
        faults: tuple[str, ...] = (),
    ) -> None:
        self.machine = shipped(Path(machine))
        self.channel = ""
        """For `can.Bus(interface="localcan", channel=bench.channel)`; empty outside the block."""
        self._options = ["--pacing", pacing, *(word for fault in faults for word in ("--fault", fault))]
        self._open = contextlib.ExitStack()

    @property
    def bus(self) -> str:
        """INTERFACE:CHANNEL, as the option `--bus` of the command lines expects it."""
        return f"localcan:{self.channel}"

    def __enter__(self) -> Self:
        """Start the simulator. Raises BenchError if it is not ready within START_LIMIT_S."""
        with contextlib.ExitStack() as opened:
            folder = opened.enter_context(tempfile.TemporaryDirectory(prefix="hil-sim-"))
            self.channel = str(Path(folder) / "can.sock")
            command = [*("run", "--machine", str(self.machine), "--bus", self.bus), *self._options]
            opened.enter_context(_simulator([sys.executable, "-m", "hil_sim.cli.main", *command]))
            self._open = opened.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop the simulator; kill it if it has not ended after STOP_LIMIT_S."""
        self._open.close()
        self.channel = ""


@contextlib.contextmanager
def _simulator(command: list[str]) -> Iterator[None]:
    """Run the simulator as a process while the context is open."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    printed: list[str] = []
    ready = threading.Event()

    def drain() -> None:
        """Read all output: a full pipe would block the simulator."""
        for line in process.stdout or ():
            if not ready.is_set():
                printed.append(line.strip())
            if READY in line:
                ready.set()
        ready.set()

    reader = threading.Thread(target=drain, daemon=True)
    reader.start()
    try:
        if not ready.wait(START_LIMIT_S) or READY not in "".join(printed[-1:]):
            raise BenchError(f"hil-sim did not start: {' | '.join(printed[-3:]) or 'it printed nothing'}")
        yield
    finally:
        process.terminate()
        try:
            process.wait(STOP_LIMIT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        reader.join()
        if process.stdout is not None:
            process.stdout.close()
