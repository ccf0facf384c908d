"""Logs the reversals of a run as JSON lines beside its recording: one object a reversal, readable meanwhile.

`add` never waits: a thread writes. Reversals that it could not write are counted and reported.
"""

import json
import os
import queue
import threading
from pathlib import Path
from typing import Any

from servo_ctrl.errors import reason_of
from servo_ctrl.learning.types import ReversalReport
from servo_ctrl.recording.recorder import CLOSE_LIMIT_S, RecordingError

REVERSALS_FILE = "reversals.jsonl"
MAX_WAITING_REVERSALS = 1000
"""Bounds the reversals that wait for a stalled disk; chosen: minutes of production."""


class ReversalLog:
    """Writes one file. Raises RecordingError if it cannot be made or exists already."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.problem = ""
        """Why writing failed; empty while it works."""
        self._refused = 0
        self._not_written = 0
        self._waiting: queue.SimpleQueue[dict[str, Any] | None] = queue.SimpleQueue()
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("x", encoding="utf-8")
        except OSError as error:
            cannot = f"cannot be written: {reason_of(error)}"
            reason = "is there already; name another directory" if path.exists() else cannot
            raise RecordingError(f"{path}: {reason}") from None
        self._writer = threading.Thread(target=self._write_all, name="reversal log", daemon=True)
        self._writer.start()

    @property
    def lost(self) -> int:
        """Number of reversals lost for the file."""
        return self._refused + self._not_written

    def add(self, report: dict[str, Any]) -> None:
        """Add one reversal, made by `reversal_entry`."""
        if self._waiting.qsize() >= MAX_WAITING_REVERSALS:
            self._refused += 1
            return
        self._waiting.put(report)

    def close(self) -> None:
        """Write the waiting reversals. Raises RecordingError if any was not written."""
        self._waiting.put(None)
        self._writer.join(CLOSE_LIMIT_S)
        if self._writer.is_alive():
            self.problem = self.problem or f"the disk did not take it within {CLOSE_LIMIT_S:g} s"
        if self.problem:
            raise RecordingError(f"{self.path}: {self.problem} ({self.lost} reversals lost)")
        if self.lost:
            raise RecordingError(f"{self.path}: the disk was too slow, {self.lost} reversals lost")

    def _write_all(self) -> None:
        while (report := self._waiting.get()) is not None:
            if self.problem:  # a partial line may be in the file, after which no line could be read
                self._not_written += 1
                continue
            try:
                self._file.write(json.dumps(report, allow_nan=False) + "\n")
                self._file.flush()
            except Exception as error:  # noqa: BLE001  # a writer that ended silently would lose the rest
                self._not_written += 1
                self._give_up(error)
        try:
            with self._file:
                os.fsync(self._file.fileno())
        except OSError as error:
            self._give_up(error)

    def _give_up(self, error: Exception) -> None:
        reason = reason_of(error) if isinstance(error, OSError) else repr(error)
        self.problem = self.problem or f"cannot be written: {reason}"


def reversal_entry(report: ReversalReport, axis: str, period_s: float, *, due: bool) -> dict[str, Any]:
    """Return one line of the log. `due`: whether learning is due after this reversal."""
    return {**report._asdict(), "axis": axis, "time_s": report.cycle * period_s, "due": due}


def read_reversals(directory: Path) -> list[dict[str, Any]]:
    """Return all complete lines of a recording's reversals, of a finished run or after a kill.

    Raises RecordingError with the path if the file is missing or damaged.
    """
    path = directory / REVERSALS_FILE
    try:
        lines = path.read_bytes().split(b"\n")[:-1]  # the last piece is empty or a partial line
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {reason_of(error)}") from None
    return [_entry(path, number, line) for number, line in enumerate(lines, start=1)]


def _entry(path: Path, number: int, line: bytes) -> dict[str, Any]:
    try:
        entry = json.loads(line)
    except (ValueError, RecursionError):
        entry = None
    if not isinstance(entry, dict):
        raise RecordingError(f"{path}: line {number} is not a reversal")
    return entry
