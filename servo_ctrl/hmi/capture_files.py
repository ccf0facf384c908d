"""What the scope shows, kept: a recording of all channels at full rate, the same as CSV, and a picture."""

from __future__ import annotations

import json
import threading
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np

from servo_ctrl.telemetry.channels import channels_of
from servo_ctrl.telemetry.parquet import reason_of, write_csv, write_part, write_whole
from servo_ctrl.telemetry.recorder import HEADER_FILE, RecordingError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from datetime import datetime
    from pathlib import Path

    from servo_ctrl.config.local_messages import Hello
    from servo_ctrl.hmi.capture_look import Trace
    from servo_ctrl.hmi.capture_stream import Rows

CSV_FILE, PICTURE_FILE, PART_FILE = "scope.csv", "scope.png", "part-00000.parquet"
_ONE_AT_A_TIME = threading.Lock()


def save_capture(
    parent: Path, hello: Hello, rows: Rows, traces: Sequence[Trace], origin: int, taken: datetime
) -> Path:
    """Write a recording's directory with CSV and picture in it; return it. Raises RecordingError."""
    if not len(rows.values):
        raise RecordingError("the scope shows nothing yet: there is nothing to save")
    directory = parent / f"scope-{taken:%Y%m%dT%H%M%S}-{taken.microsecond // 1000:03d}"
    axes = [axis.name for axis in hello.axes]
    channels = channels_of(axes)
    if [channel.name for channel in channels] != [channel.name for channel in hello.channels]:
        raise RecordingError("the machine's channels are not those of a recording of this software")
    header = {
        "format": 1,
        "software": f"servo_ctrl {version('servo-ctrl')}",
        "machine": hello.machine,
        "axes": axes,
        "period_s": hello.period_s,
        "pacing": "realtime",
        "started": taken.isoformat(timespec="milliseconds"),
        "program": None,
        "channels": {c.name: {"unit": c.unit, "dtype": c.dtype, "meaning": c.meaning} for c in channels},
        "segments": [],
        "finished": True,
        "completed": True,
        "reason": "saved from the scope",
    }
    # matplotlib, some 30 MB, comes with the first capture
    from servo_ctrl.hmi.capture_picture import draw_capture  # noqa: PLC0415

    with _ONE_AT_A_TIME:
        try:
            directory.mkdir(parents=True)
            values = _whole_numbers(rows.values, [channel.dtype for channel in channels])
            write_part(directory / PART_FILE, channels, values)
            named = {c.name: values[:, place].astype(c.dtype) for place, c in enumerate(channels)}
            write_csv(directory / CSV_FILE, named)
            draw_capture(directory / PICTURE_FILE, rows, traces, origin, hello)
            _write_header(directory / HEADER_FILE, header)  # last: a directory that has it is whole
        except OSError as error:
            raise RecordingError(f"{directory}: cannot be written: {reason_of(error)}") from None
    return directory


def _whole_numbers(values: np.ndarray[Any, np.dtype[np.float64]], dtypes: Sequence[str]) -> Any:
    """Missing values of columns of integers become 0: such a column knows no other."""
    whole = np.array([np.issubdtype(np.dtype(dtype), np.integer) for dtype in dtypes])
    return np.where(whole & ~np.isfinite(values), 0.0, values)


def _write_header(path: Path, header: dict[str, Any]) -> None:
    text = json.dumps(header, indent=2) + "\n"
    write_whole(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))
