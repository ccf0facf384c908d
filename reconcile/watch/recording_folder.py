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
"""Magic number at the beginning and at the end of a Parquet file."""


class FileStamp(NamedTuple):
    """The state of all files of a recording together."""

    size_bytes: int
    modified_ns: int
    """Time of the last change, since 1970."""


class CompleteRecording(NamedTuple):
    """A complete recording in the folder."""

    path: Path
    stamp: FileStamp
    started_s: float
    """Start of the recording, else last change of the file; seconds since 1970."""


class RecordingFolder:
    """Lists the recordings of a folder repeatedly; `excluded` is a folder inside it without recordings."""

    def __init__(self, folder: Path, excluded: Path) -> None:
        if not folder.is_dir():
            raise ReconcileError(folder, "", "is not a directory", "name the directory of the recordings")
        self._folder, self._excluded = folder, excluded.resolve()
        self._unchanged_since: dict[str, tuple[FileStamp, float]] = {}
        self.unfinished: list[str] = []
        """Recordings that were still being written at the last listing."""

    def list_complete(self) -> list[CompleteRecording]:
        """Return all complete recordings, the oldest first. Raises ReconcileError: folder not readable."""
        complete, self.unfinished = [], []
        try:
            paths = sorted(self._folder.iterdir())
        except OSError as error:
            raise ReconcileError(self._folder, "", f"cannot be read: {reason_of(error)}") from None
        for path in paths:
            try:
                recording = self._complete_recording(path)
            except OSError:
                continue  # it was removed meanwhile
            if recording is not None:
                complete.append(recording)
        return sorted(complete, key=lambda recording: (recording.started_s, recording.path.name))

    def machine_name(self) -> str:
        """Return the name of the machine in the first recording that has one, else that of the folder."""
        headers = sorted(self._folder.glob(f"*/{HEADER_FILE}"))
        names = (_header(file).get("machine") for file in headers)
        return next((name for name in names if isinstance(name, str)), self._folder.resolve().name)

    def _complete_recording(self, path: Path) -> CompleteRecording | None:
        """Return the recording at a path; None if it is none, or is still being written (`unfinished`)."""
        header: dict[str, Any] = {}
        is_complete: bool | None = None  # None: its format does not say
        if path.name.startswith(".") or path.resolve() == self._excluded:
            return None
        if path.is_dir():
            if not (path / HEADER_FILE).is_file():
                return None
            header = _header(path / HEADER_FILE)
            parts = [path / HEADER_FILE, *path.glob("part-*.parquet")]
            is_complete = header.get("finished") is True or None
        elif path.suffix.lower() in {*READERS, CANDUMP}:
            parts = [path]
            is_complete = _has_table_of_contents(path)
        else:
            return None
        states = [part.stat() for part in parts]
        stamp = FileStamp(
            size_bytes=sum(state.st_size for state in states),
            modified_ns=max(state.st_mtime_ns for state in states),
        )
        if not (self._is_unchanged(path.name, stamp) if is_complete is None else is_complete):
            self.unfinished.append(path.name)
            return None
        return CompleteRecording(path, stamp, _started_s(header, stamp))

    def _is_unchanged(self, name: str, stamp: FileStamp) -> bool:
        """Return whether the files have not changed for a while, by their time stamp or by listings."""
        now_s = time.monotonic()
        previous, since_s = self._unchanged_since.get(name, (None, now_s))
        self._unchanged_since[name] = stamp, since_s if previous == stamp else now_s
        return time.time() - stamp.modified_ns * 1e-9 > COMPLETE_AFTER_S or (
            previous == stamp and now_s - since_s > COMPLETE_AFTER_S
        )


def _header(file: Path) -> dict[str, Any]:
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def _has_table_of_contents(path: Path) -> bool | None:
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


def _started_s(header: dict[str, Any], stamp: FileStamp) -> float:
    try:
        started = datetime.fromisoformat(str(header.get("started", "")))
    except ValueError:
        return stamp.modified_ns * 1e-9
    return (started if started.tzinfo else started.replace(tzinfo=UTC)).timestamp()
