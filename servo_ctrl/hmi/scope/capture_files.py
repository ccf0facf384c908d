"""Saves what the scope shows: a recording of all channels at full rate, the same as CSV, and a picture."""

import json
import threading
from collections.abc import Sequence
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.errors import reason_of
from servo_ctrl.files.arrow import write_csv, write_part
from servo_ctrl.files.whole_file import write_text_whole
from servo_ctrl.hmi.scope.appearance import ShownChannel
from servo_ctrl.hmi.scope.stream import CapturedRows
from servo_ctrl.recording.channels import channels_of
from servo_ctrl.recording.recorder import HEADER_FILE, RecordingError

CSV_FILE, PICTURE_FILE, PART_FILE = "scope.csv", "scope.png", "part-00000.parquet"
_ONE_CAPTURE = threading.Lock()
"""One capture is saved at a time: a minute of rows takes some 100 MB while it is written."""


def save_capture(
    parent: Path,
    hello: Hello,
    rows: CapturedRows,
    shown: Sequence[ShownChannel],
    *,
    origin: int,
    taken: datetime,
) -> Path:
    """Write a recording directory with CSV and picture in it, and return it. Raises RecordingError.

    `origin` is the row at which the time of the picture is zero.
    """
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
    # matplotlib takes some 30 MB: import it with the first capture
    from servo_ctrl.hmi.scope.capture_picture import draw_capture  # noqa: PLC0415

    with _ONE_CAPTURE:
        try:
            directory.mkdir(parents=True)
            values = _without_missing_integers(rows.values, [channel.dtype for channel in channels])
            write_part(directory / PART_FILE, channels, values)
            named = {c.name: values[:, place].astype(c.dtype) for place, c in enumerate(channels)}
            write_csv(directory / CSV_FILE, named)
            draw_capture(directory / PICTURE_FILE, rows, shown, hello, origin)
            # the header last: a directory with a header is a whole recording
            write_text_whole(directory / HEADER_FILE, json.dumps(header, indent=2) + "\n")
        except OSError as error:
            raise RecordingError(f"{directory}: cannot be written: {reason_of(error)}") from None
    return directory


def _without_missing_integers(values: np.ndarray[Any, np.dtype[np.float64]], dtypes: Sequence[str]) -> Any:
    """The rows with 0 for the missing values of integer columns, which cannot hold NaN."""
    whole = np.array([np.issubdtype(np.dtype(dtype), np.integer) for dtype in dtypes])
    return np.where(whole & ~np.isfinite(values), 0.0, values)
