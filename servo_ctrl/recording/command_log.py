"""Logs commands with source and time: one JSON line a request, synced before the next line is written.

The file is append-only. A line is complete or absent: a partial line after a crash or a full disk is removed
before the next one. `add` does not block: a thread writes, and requests that it could not write are counted
and reported.
"""

import errno
import json
import os
import queue
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from servo_ctrl.config.file_format import FORMAT
from servo_ctrl.errors import ServoCtrlError, reason_of
from servo_ctrl.files.directory import make_directory, sync_directory

COMMANDS_FILE = "commands.jsonl"
MAX_WAITING_LINES = 1000
"""Bounds the lines that wait for a stalled disk; further lines are lost and counted; chosen."""
CLOSE_LIMIT_S = 5.0
"""Bounds how long `close` waits for the disk; chosen."""
_TAIL_BYTES = 65536
"""Bounds the length of a line; chosen."""


class CommandLogError(ServoCtrlError):
    """The log cannot be written."""


class CommandLog:
    """Appends to one file, created if absent. Raises CommandLogError when it cannot be opened.

    The writer's thread calls `on_problem` once each time that writing begins to fail.
    """

    def __init__(self, path: Path, on_problem: Callable[[str], None]) -> None:
        self.path = path
        self.lost = 0
        """Number of requests that are not in the file."""
        self._on_problem = on_problem
        self._waiting: queue.SimpleQueue[dict[str, Any] | None] = queue.SimpleQueue()
        self._failing = False
        try:
            make_directory(path.parent)
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o640)
        except OSError as error:
            raise CommandLogError(f"{path}: cannot be written: {reason_of(error)}") from None
        try:
            _cut_torn_line(self._file)
            sync_directory(path.parent)
        except OSError as error:
            os.close(self._file)
            raise CommandLogError(f"{path}: cannot be written: {reason_of(error)}") from None
        self._writer = threading.Thread(target=self._write_all, name="command log", daemon=True)
        self._writer.start()

    def add(self, entry: dict[str, Any]) -> None:
        """Add one request and its answer."""
        if self._waiting.qsize() >= MAX_WAITING_LINES:
            self.lost += 1
            return
        self._waiting.put(entry)

    def close(self) -> str:
        """Write the waiting lines; return what was lost, else "". Blocks for a bounded time."""
        self._waiting.put(None)
        self._writer.join(CLOSE_LIMIT_S)
        if self._writer.is_alive():
            return f"{self.path}: the disk did not take it within {CLOSE_LIMIT_S:g} s"
        return f"{self.path}: {self.lost} requests are not in it" if self.lost else ""

    def _write_all(self) -> None:
        while (entry := self._waiting.get()) is not None:
            text = json.dumps({"format": FORMAT, **entry}, allow_nan=False, ensure_ascii=True)
            line = text.encode() + b"\n"
            try:
                append_line(self._file, line)
                self._failing = False
            except OSError as error:
                self.lost += 1
                if not self._failing:
                    self._on_problem(f"{self.path}: cannot be written: {reason_of(error)}")
                self._failing = True
        os.close(self._file)


def append_line(file: int, line: bytes) -> None:
    """Append a line and sync it, or leave the file as it was. Raises OSError."""
    length = os.fstat(file).st_size
    try:
        _write(file, line)
        os.fsync(file)
    except OSError:
        os.ftruncate(file, length)
        raise


def _write(file: int, line: bytes) -> None:
    if os.write(file, line) != len(line):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def _cut_torn_line(file: int) -> None:
    """Remove a torn line at the end. Raises OSError."""
    length = os.fstat(file).st_size
    start = max(length - _TAIL_BYTES, 0)
    tail = os.pread(file, length - start, start)
    if tail and not tail.endswith(b"\n"):
        os.ftruncate(file, start + tail.rfind(b"\n") + 1)
