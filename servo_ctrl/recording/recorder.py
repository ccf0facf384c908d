"""Records rows: the cycle fills preallocated chunks, a thread writes them to the disk.

`record` only copies one row. The writer receives full chunks through a queue, writes each as a Parquet part
and returns the chunk for reuse. Rows that it could not write are counted and reported.
"""

import json
import queue
import threading
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from kernels.arrays import Array
from servo_ctrl.errors import ServoCtrlError, reason_of
from servo_ctrl.files.whole_file import write_text_whole
from servo_ctrl.recording.channels import Channel

ROWS_PER_PART = 2000
"""Bounds the rows that a kill -9 loses; chosen: two seconds at 1 kHz."""
CHUNKS = 8
"""Number of chunks; chosen: bridges a disk stalled for 16 s at 1 kHz."""
CLOSE_LIMIT_S = 30.0
"""Bounds how long `close` waits for the disk; chosen longer than the time that the chunks bridge."""
HEADER_FILE = "recording.json"
LOSS = "loss"
"""Header key that says which rows are missing in the parts, and why."""

Chunk = np.ndarray[Any, np.dtype[np.float64]]


class RecordingError(ServoCtrlError):
    """A recording that cannot be made or read; the message names the directory."""


@cache
def _arrow() -> ModuleType:
    """Import Arrow for the first recorder, because a run without a recording saves 30 MB."""
    from servo_ctrl.files import arrow  # noqa: PLC0415

    return arrow


def write_part(path: Path, channels: Sequence[Channel], rows: Chunk) -> None:
    """Write a part with `files.arrow`."""
    _arrow().write_part(path, channels, rows)


class Recorder:
    """Writes one recording directory. `wait_s`: how long `record` may wait for a free chunk, once.

    In lockstep it may wait, because simulated time stands still; in real time it must not (0): then rows are
    lost and counted in `rows_lost`. Raises RecordingError if the directory cannot be made or is in use.
    """

    def __init__(
        self,
        directory: Path,
        channels: Sequence[Channel],
        header: dict[str, Any],
        *,
        wait_s: float = 0.0,
        rows_per_part: int = ROWS_PER_PART,
    ) -> None:
        self.directory = directory
        self.rows_lost = 0
        self.problem = ""
        """Why writing failed; empty while it works."""
        self._channels = tuple(channels)
        self._wait_s = wait_s
        self._parts = 0
        self._free: queue.SimpleQueue[Chunk] = queue.SimpleQueue()
        self._full: queue.SimpleQueue[Chunk | dict[str, Any] | None] = queue.SimpleQueue()
        for _ in range(CHUNKS):
            self._free.put(np.full((rows_per_part, len(self._channels)), np.nan))
        self._chunk: Chunk | None = self._free.get()
        self._row = 0
        self._rows_per_part = rows_per_part
        self._handed_over = self._settled = 0
        """Rows handed to the writer, and rows that it has written or counted as lost."""
        self._open(header)
        _arrow()  # import it now rather than with the first part, during the cycle
        self._writer = threading.Thread(target=self._write_all, name="recorder", daemon=True)
        self._writer.start()

    @property
    def loss(self) -> str:
        """Which rows are missing in the parts, and why; "" if none is."""
        if self.problem:
            return f"{self.problem} ({self.rows_lost} rows lost)"
        return f"the disk was too slow, {self.rows_lost} rows lost" if self.rows_lost else ""

    def record(self, values: Sequence[float] | Array) -> None:
        """Add one row, in channel order; an array is copied from memory to memory."""
        chunk = self._chunk
        if chunk is None:
            chunk = self._chunk = self._next_chunk()
            if chunk is None:
                self.rows_lost += 1
                return
        chunk[self._row] = values
        self._row += 1
        if self._row == self._rows_per_part:
            self._hand_over(chunk)
            self._chunk = None
            self._row = 0

    def update_header(self, header: dict[str, Any]) -> None:
        """Replace recording.json, in the writer's thread."""
        self._full.put(header)

    def close(self, header: dict[str, Any]) -> None:
        """Write the remaining rows and the final header. Raises RecordingError if any row is missing."""
        if self._chunk is not None and self._row > 0:
            self._hand_over(self._chunk[: self._row])
        self._chunk = None
        self._full.put(header)
        self._full.put(None)
        self._writer.join(CLOSE_LIMIT_S)
        if self._writer.is_alive():
            self.problem = self.problem or f"the disk did not take it within {CLOSE_LIMIT_S:g} s"
            self.rows_lost += self._handed_over - self._settled
        if self.loss:
            raise RecordingError(f"{self.directory}: {self.loss}")

    def _open(self, header: dict[str, Any]) -> None:
        if (self.directory / HEADER_FILE).exists() or any(self.directory.glob("part-*.parquet")):
            raise RecordingError(f"{self.directory}: holds a recording already; name another directory")
        try:
            self.directory.mkdir(parents=True, exist_ok=True)
            self._write_header(header)
        except OSError as error:
            raise RecordingError(f"{self.directory}: cannot be written: {reason_of(error)}") from None

    def _hand_over(self, chunk: Chunk) -> None:
        self._handed_over += len(chunk)
        self._full.put(chunk)

    def _next_chunk(self) -> Chunk | None:
        try:
            return self._free.get(timeout=self._wait_s) if self._wait_s > 0.0 else self._free.get_nowait()
        except queue.Empty:
            self._wait_s = 0.0  # wait only once: the disk hangs, and waiting delays the axes
            return None

    def _write_all(self) -> None:
        while (item := self._full.get()) is not None:
            try:
                if isinstance(item, dict):
                    self._write_header(item)
                else:
                    self._write_chunk(item)
            except Exception as error:  # noqa: BLE001  # a writer that ended silently would lose the rest
                reason = reason_of(error) if isinstance(error, OSError) else repr(error)
                self.problem = self.problem or f"cannot be written: {reason}"

    def _write_chunk(self, chunk: Chunk) -> None:
        try:
            if self.problem:
                self.rows_lost += len(chunk)
                return
            write_part(self.directory / f"part-{self._parts:05d}.parquet", self._channels, chunk)
            self._parts += 1
        except Exception:
            self.rows_lost += len(chunk)
            raise
        finally:
            self._settled += len(chunk)
            if len(chunk) == self._rows_per_part:
                self._free.put(chunk)

    def _write_header(self, header: dict[str, Any]) -> None:
        content = header | ({LOSS: self.loss} if self.loss else {})
        write_text_whole(self.directory / HEADER_FILE, json.dumps(content, indent=2) + "\n")
