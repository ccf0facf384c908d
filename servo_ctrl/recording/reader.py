"""Reads recordings into arrays, finished ones and those cut off by a kill."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from servo_ctrl.config.file_format import format_problem
from servo_ctrl.recording.recorder import HEADER_FILE, LOSS, RecordingError


@dataclass(frozen=True, slots=True)
class Recording:
    """A loaded recording: `columns` name -> array (N), all of one length; `header` is recording.json."""

    directory: Path
    header: dict[str, Any]
    columns: dict[str, np.ndarray[Any, np.dtype[Any]]]

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the axes, in recording order."""
        return tuple(self.header["axes"])

    def segment(self, label: str) -> dict[str, np.ndarray[Any, np.dtype[Any]]]:
        """Return the columns of the first segment with this label. Raises RecordingError if there is none."""
        labels = [segment["label"] for segment in self.header["segments"]]
        if label not in labels:
            raise RecordingError(f"{self.directory}: no segment {label!r}; there are: {', '.join(labels)}")
        rows = self.columns["segment"] == labels.index(label)
        return {name: column[rows] for name, column in self.columns.items()}


def load_recording(directory: Path) -> Recording:
    """Read a recording directory. Raises RecordingError if it is damaged or no recording."""
    from servo_ctrl.files.arrow import read_parts  # noqa: PLC0415  # 30 MB that a run needs only at its end

    try:
        header = json.loads((directory / HEADER_FILE).read_text(encoding="utf-8"))
        problem = format_problem(header.get("format")) if isinstance(header, dict) else "is not JSON object"
        if problem:
            raise RecordingError(f"{directory}: {HEADER_FILE} {problem}")
        parts = sorted(directory.glob("part-*.parquet"))
        if not parts:
            raise RecordingError(f"{directory}: the recording has no rows: {_why_empty(header)}")
        columns = read_parts(parts)
    except FileNotFoundError:
        raise RecordingError(f"{directory}: is not a recording ({HEADER_FILE} is missing)") from None
    except (OSError, ValueError, RecursionError) as error:
        raise RecordingError(f"{directory}: cannot be read: {error}") from None
    return Recording(directory, header, columns)


def _why_empty(header: dict[str, Any]) -> str:
    if loss := header.get(LOSS):
        return " ".join(str(loss).split())
    if header.get("finished"):
        return "its run was over before its first cycle"
    return "its run goes on and has not come so far, was killed before, or the disk was full"
