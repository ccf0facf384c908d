"""The journal of a learning run: keeps every stroke, so that the run continues after a restart.

DIR/x/journal.jsonl has a header line, then one line a stroke with its errors in whole nanometres, each with a
checksum. A line is on the disk when `append` returns; a partial last line after a crash is dropped.
"""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from servo_ctrl.errors import reason_of
from servo_ctrl.files.directory import make_directory, sync_directory
from servo_ctrl.files.whole_file import write_whole
from servo_ctrl.learned.file_model import difference
from servo_ctrl.learned.journal_lines import Header, StrokeLine, decoded, encoded
from servo_ctrl.learned.store import StoreError
from servo_ctrl.learning.types import LearningSettings, Stroke, StrokeResult

JOURNAL_FILE = "journal.jsonl"
PREVIOUS_FILE = "journal.previous.jsonl"
"""Name under which a journal that cannot be continued is kept."""
JOURNAL_BYTES_MAX = 200_000_000
"""Bounds the bytes of a journal; chosen: a thousand strokes have about seven million."""


class _JournalContent(NamedTuple):
    """The usable content of a journal."""

    entries: list[tuple[Stroke, StrokeResult]]
    end: int
    """Bytes of header and strokes before the first damage."""
    checksum: int
    """Checksum of the last intact line."""
    problem: str


EMPTY_JOURNAL = _JournalContent([], 0, 0, "")


class StrokeJournal:
    """The journal of one axis. `basis`: machine-file values that must not change, see `LearnedContent`.

    After `replay` `problem` says why a journal was not or not completely usable, else "".
    """

    def __init__(
        self,
        directory: Path,
        axis: str,
        settings: LearningSettings,
        *,
        basis: Mapping[str, float | str] | None = None,
    ) -> None:
        self.problem = ""
        self.path = directory / axis / JOURNAL_FILE
        self._header = Header(
            axis=axis,
            settings={
                key: list(value) if isinstance(value, tuple) else value
                for key, value in settings._asdict().items()
            },
            basis=dict(basis or {}),
        )
        self._end = self._checksum = 0
        self._size: int | None = None
        """Size of the file in bytes after the last access of this object; None before the first."""

    def replay(self) -> list[tuple[Stroke, StrokeResult]]:
        """Return the strokes so far, identical to the appended ones; empty without a journal.

        Strokes after a damaged line are ignored. Raises StoreError when the file cannot be read.
        """
        try:
            data = self._bytes()
        except OSError as error:
            raise StoreError(f"{self.path}: cannot be read: {reason_of(error)}") from None
        content = self._usable_content(data)
        self.problem = f"{self.path}: {content.problem}" if content.problem else ""
        self._end, self._checksum, self._size = content.end, content.checksum, len(data)
        return content.entries

    def append(self, stroke: Stroke, result: StrokeResult) -> None:
        """Add a stroke and return once it is on the disk.

        Raises StoreError, and ValueError for a result not in whole nanometres.
        """
        entry = StrokeLine.of(stroke, result)
        try:
            if self._size is None:
                self.replay()
            if self.problem or not self._end:
                self._begin()
            line, checksum = encoded(entry, self._checksum)
            self._write(line)
        except OSError as error:
            self._size = None
            raise StoreError(f"{self.path}: cannot be written: {reason_of(error)}") from None
        self._checksum = checksum

    def remove(self) -> None:
        """Delete the journal. Raises StoreError."""
        try:
            self.path.unlink(missing_ok=True)
            if self.path.parent.is_dir():
                sync_directory(self.path.parent)
        except OSError as error:
            raise StoreError(f"{self.path}: cannot be removed: {reason_of(error)}") from None
        self._size, self.problem = None, ""

    def _begin(self) -> None:
        """Write the intact part of the file again, and keep a damaged original beside it."""
        make_directory(self.path.parent)
        data = self._bytes()
        if self.problem:
            write_whole(self.path.with_name(PREVIOUS_FILE), lambda temporary: temporary.write_bytes(data))
        intact = data[: self._end]
        if not intact:
            intact, self._checksum = encoded(self._header, 0)
        write_whole(self.path, lambda temporary: temporary.write_bytes(intact))
        self._end = self._size = len(intact)
        self.problem = ""

    def _write(self, line: bytes) -> None:
        with self.path.open("r+b", buffering=0) as file:
            if os.fstat(file.fileno()).st_size != self._size:
                raise OSError("another process has changed it")
            file.truncate(self._end)  # remove a partial line
            file.seek(self._end)
            remaining = memoryview(line)
            while remaining:
                remaining = remaining[file.write(remaining) :]
            os.fsync(file.fileno())
        self._end = self._size = self._end + len(line)

    def _bytes(self) -> bytes:
        try:
            with self.path.open("rb") as file:
                # Not `read(JOURNAL_BYTES_MAX)`: Python allocates that much memory at once, and with locked
                # memory this stalls the cycle.
                if os.fstat(file.fileno()).st_size > JOURNAL_BYTES_MAX:
                    raise OSError(f"it has more than {JOURNAL_BYTES_MAX} bytes")
                return file.read()
        except FileNotFoundError:
            return b""

    def _usable_content(self, data: bytes) -> _JournalContent:
        if not data:
            return EMPTY_JOURNAL
        # an interrupted `append` leaves text after the last line end
        *lines, _ = data.split(b"\n")
        try:
            header, checksum = decoded(Header, lines[0] if lines else b"", 0)
        except ValueError as error:
            return EMPTY_JOURNAL._replace(problem=f"its header {error}")
        if changed := self._setting_change(header):
            return EMPTY_JOURNAL._replace(problem=f"was made with other settings: {changed}")
        entries: list[tuple[Stroke, StrokeResult]] = []
        end, problem = len(lines[0]) + 1, ""
        for number, line in enumerate(lines[1:], start=2):
            try:
                content, next_checksum = decoded(StrokeLine, line, checksum)
                entries.append(content.entry())
            except ValueError as error:
                problem = f"line {number} {error}; the {len(entries)} strokes before it are used"
                break
            end, checksum = end + len(line) + 1, next_checksum
        return _JournalContent(entries, end, checksum, problem)

    def _setting_change(self, header: Header) -> str:
        """Return which setting has changed since the journal was started, else ""."""
        current = self._header
        return difference(
            {"axis": header.axis, **header.settings, **header.basis},
            {"axis": current.axis, **current.settings, **current.basis},
        )
