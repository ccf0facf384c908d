"""Finds the complete recordings of a folder, in order of time.

`servo-ctrl` marks a finished recording in recording.json; a Parquet or npz file ends with its table of
contents. Any other file, and that of a killed run, counts as complete when it has not changed for a while.
"""

import json
import time
import zipfile
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from reconcile.errors import ReconcileError
from reconcile.formats.readers import CANDUMP, READERS
from servo_ctrl.errors import reason_of
from servo_ctrl.recording.recorder import HEADER_FILE

COMPLETE_AFTER_S = 2.0
"""Time without a change after which a file counts as complete."""
PARQUET_MARK = b"PAR1"

Stamp = tuple[int, int]
"""Bytes and time of the last change (ns), of all files of a recording together."""


class Arrival(NamedTuple):
    """A complete recording."""

    path: Path
    stamp: Stamp
    started_s: float
    """Start of the recording, else last change of the file; seconds since 1970."""


class Arrivals:
    """Lists a folder repeatedly; `excluded` is a folder inside it that holds no recordings."""

    def __init__(self, folder: Path, excluded: Path) -> None:
        if not folder.is_dir():
            raise ReconcileError(folder, "", "is no directory", "name the directory of the recordings")
        self._folder, self._excluded = folder, excluded.resolve()
        self._seen: dict[str, tuple[Stamp, float]] = {}
        self.unfinished: list[str] = []
        """Recordings that were still being written at the last listing."""

    def list_complete(self) -> list[Arrival]:
        """Return all complete recordings, the oldest first. Raises ReconcileError: folder not readable."""
        found, self.unfinished = [], []
        try:
            paths = sorted(self._folder.iterdir())
        except OSError as error:
            raise ReconcileError(self._folder, "", f"cannot be read: {reason_of(error)}") from None
        for path in paths:
            try:
                arrival = self._arrival(path)
            except OSError:
                continue  # it was removed meanwhile
            if arrival is not None:
                found.append(arrival)
        return sorted(found, key=lambda one: (one.started_s, one.path.name))

    def machine(self) -> str:
        """Return the name of the machine in the first recording that has one, else that of the folder."""
        headers = sorted(self._folder.glob(f"*/{HEADER_FILE}"))
        named = (_header(file).get("machine") for file in headers)
        return next((name for name in named if isinstance(name, str)), self._folder.resolve().name)

    def _arrival(self, path: Path) -> Arrival | None:
        header: dict[str, Any] = {}
        complete: bool | None = None
        if path.name.startswith(".") or path.resolve() == self._excluded:
            return None
        if path.is_dir():
            if not (path / HEADER_FILE).is_file():
                return None
            header = _header(path / HEADER_FILE)
            parts = [path / HEADER_FILE, *path.glob("part-*.parquet")]
            complete = header.get("finished") is True or None
        elif path.suffix.lower() in {*READERS, CANDUMP}:
            parts = [path]
            complete = _has_its_end(path)
        else:
            return None
        states = [part.stat() for part in parts]
        stamp = sum(state.st_size for state in states), max(state.st_mtime_ns for state in states)
        if not (self._unchanged(path.name, stamp) if complete is None else complete):
            self.unfinished.append(path.name)
            return None
        return Arrival(path, stamp, _started_s(header, stamp))

    def _unchanged(self, name: str, stamp: Stamp) -> bool:
        """Return whether the files are unchanged for a while, by time stamp or by listings."""
        now_s = time.monotonic()
        before, since_s = self._seen.get(name, (None, now_s))
        self._seen[name] = stamp, since_s if before == stamp else now_s
        return time.time() - stamp[1] * 1e-9 > COMPLETE_AFTER_S or (
            before == stamp and now_s - since_s > COMPLETE_AFTER_S
        )


def _header(file: Path) -> dict[str, Any]:
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def _has_its_end(path: Path) -> bool | None:
    """Return whether a file ends with its table of contents; None for a format that has none."""
    match path.suffix.lower():
        case ".parquet":
            with path.open("rb") as file:
                begins = file.read(4) == PARQUET_MARK
                file.seek(max(path.stat().st_size - 4, 8))
                return begins and file.read(4) == PARQUET_MARK
        case ".npz":
            return zipfile.is_zipfile(path)
    return None


def _started_s(header: dict[str, Any], stamp: Stamp) -> float:
    try:
        started = datetime.fromisoformat(str(header.get("started", "")))
    except ValueError:
        return stamp[1] * 1e-9
    return (started if started.tzinfo else started.replace(tzinfo=UTC)).timestamp()
