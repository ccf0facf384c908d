"""The recordings of a folder in order of time, and only those that are complete.

`servo-ctrl` says in recording.json that a recording is finished, a Parquet or npz file ends with its table of
contents. Of all others, and of a run that was killed, the size must have rested for a while.
"""

from __future__ import annotations

import json
import time
import zipfile
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, NamedTuple

from reconcile.errors import ReconcileError
from reconcile.formats.readers import CANDUMP, READERS
from servo_ctrl.telemetry.parquet import reason_of
from servo_ctrl.telemetry.recorder import HEADER_FILE

if TYPE_CHECKING:
    from pathlib import Path

REST_S = 2.0
"""A file that has not grown for so long is complete."""
PARQUET_MARK = b"PAR1"

Stamp = tuple[int, int]
"""Bytes and time of the last change (ns), of all files of a recording together."""


class Arrival(NamedTuple):
    """A recording that may be read."""

    path: Path
    stamp: Stamp
    started_s: float
    """As the recording says, else when the file was last changed; seconds since 1970."""


class Arrivals:
    """Looks into a folder, again and again. `beside`: a folder inside it that holds no recordings."""

    def __init__(self, folder: Path, beside: Path) -> None:
        if not folder.is_dir():
            raise ReconcileError(folder, "", "is no directory", "name the directory of the recordings")
        self._folder, self._beside = folder, beside.resolve()
        self._seen: dict[str, tuple[Stamp, float]] = {}
        self.unfinished: list[str] = []
        """What was there at the last look and is still being written."""

    def look(self) -> list[Arrival]:
        """All complete recordings, the oldest first. Raises ReconcileError: the folder cannot be read."""
        found, self.unfinished = [], []
        try:
            paths = sorted(self._folder.iterdir())
        except OSError as error:
            raise ReconcileError(self._folder, "", f"cannot be read: {reason_of(error)}") from None
        for path in paths:
            try:
                arrival = self._arrival(path)
            except OSError:
                continue  # it has just been taken away
            if arrival is None:
                continue
            found.append(arrival)
        return sorted(found, key=lambda one: (one.started_s, one.path.name))

    def machine(self) -> str:
        """What the first recording that says so calls the machine; else the folder's name."""
        headers = sorted(self._folder.glob(f"*/{HEADER_FILE}"))
        named = (_header(file).get("machine") for file in headers)
        return next((name for name in named if isinstance(name, str)), self._folder.resolve().name)

    def _arrival(self, path: Path) -> Arrival | None:
        header: dict[str, Any] = {}
        if path.name.startswith(".") or path.resolve() == self._beside:
            return None
        if path.is_dir():
            if not (path / HEADER_FILE).is_file():
                return None
            header = _header(path / HEADER_FILE)
            parts = [path / HEADER_FILE, *path.glob("part-*.parquet")]
            complete = header.get("finished") is True
        elif path.suffix.lower() in {*READERS, CANDUMP}:
            parts = [path]
            complete = _has_its_end(path)
        else:
            return None
        states = [part.stat() for part in parts]
        stamp = sum(state.st_size for state in states), max(state.st_mtime_ns for state in states)
        if not (complete or (self._rests(path.name, stamp) and _readable(path))):
            self.unfinished.append(path.name)
            return None
        return Arrival(path, stamp, _started_s(header, stamp))

    def _rests(self, name: str, stamp: Stamp) -> bool:
        """By the clock of the machine that wrote it, or by our own looks if that is another one."""
        now_s = time.monotonic()
        before, since_s = self._seen.get(name, (None, now_s))
        self._seen[name] = stamp, since_s if before == stamp else now_s
        return time.time() - stamp[1] * 1e-9 > REST_S or (before == stamp and now_s - since_s > REST_S)


def _header(file: Path) -> dict[str, Any]:
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def _has_its_end(path: Path) -> bool:
    match path.suffix.lower():
        case ".parquet":
            return _is_whole_parquet(path)
        case ".npz":
            return zipfile.is_zipfile(path)
    return False


def _readable(path: Path) -> bool:
    """Whether rest is enough: what lacks its table of contents can never be read."""
    return path.is_dir() or path.suffix.lower() not in {".parquet", ".npz"}


def _is_whole_parquet(path: Path) -> bool:
    with path.open("rb") as file:
        if file.read(4) != PARQUET_MARK:
            return False
        file.seek(0, 2)
        if file.tell() < 12:
            return False
        file.seek(-4, 2)
        return file.read(4) == PARQUET_MARK


def _started_s(header: dict[str, Any], stamp: Stamp) -> float:
    try:
        started = datetime.fromisoformat(str(header.get("started", "")))
    except ValueError:
        return stamp[1] * 1e-9
    return (started if started.tzinfo else started.replace(tzinfo=UTC)).timestamp()
