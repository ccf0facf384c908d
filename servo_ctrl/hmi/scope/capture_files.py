"""Saves what the scope shows: a recording of all channels at full rate, the same as CSV, and a picture."""

import json
import threading
from collections.abc import Sequence
from datetime import datetime
from importlib.metadata import version
from pathlib import Path

import numpy as np

from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.errors import reason_of
from servo_ctrl.files.whole_file import write_text_whole
from servo_ctrl.hmi.charts.frames import bucket_places
from servo_ctrl.hmi.scope.appearance import ShownChannel, panes_of, time_unit
from servo_ctrl.hmi.scope.stream import CapturedRows
from servo_ctrl.hmi.shell.plots import LIGHT
from servo_ctrl.recording.channels import channels_of
from servo_ctrl.recording.min_max import bucket_rows, min_max
from servo_ctrl.recording.recorder import HEADER_FILE, RecordingError

CSV_FILE, PICTURE_FILE, PART_FILE = "scope.csv", "scope.png", "part-00000.parquet"
PICTURE_WIDTH_PX = 1200
"""Width of a saved picture, pixels; chosen."""
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
    from servo_ctrl.files.arrow import write_csv, write_part  # noqa: PLC0415  # 25 MB until the first capture

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
    with _ONE_CAPTURE:
        try:
            directory.mkdir(parents=True)
            # integer columns cannot hold NaN: their missing values are 0
            whole = [np.issubdtype(np.dtype(channel.dtype), np.integer) for channel in channels]
            recorded = rows.values[:, : len(channels)]  # what the scope computes is drawn, and not recorded
            values = np.where(np.array(whole) & ~np.isfinite(recorded), 0.0, recorded)
            write_part(directory / PART_FILE, channels, values)
            named = {c.name: values[:, place].astype(c.dtype) for place, c in enumerate(channels)}
            write_csv(directory / CSV_FILE, named)
            _draw_capture(directory / PICTURE_FILE, rows, shown, hello, origin)
            # the header last: a directory with a header is a whole recording
            write_text_whole(directory / HEADER_FILE, json.dumps(header, indent=2) + "\n")
        except OSError as error:
            raise RecordingError(f"{directory}: cannot be written: {reason_of(error)}") from None
    return directory


def _draw_capture(
    path: Path, rows: CapturedRows, shown: Sequence[ShownChannel], hello: Hello, origin: int
) -> None:
    """Draw the channels in panes by unit, with time zero at row `origin`. Raises OSError."""
    # matplotlib takes some 30 MB: import it with the first capture
    from servo_ctrl.plots.figures import save  # noqa: PLC0415
    from servo_ctrl.plots.matplotlib_agg import Figure  # noqa: PLC0415

    panes, count = panes_of(shown), len(rows.values)
    bucket = bucket_rows(count, PICTURE_WIDTH_PX)
    time = time_unit(count * hello.period_s)
    figure = Figure(figsize=(10.0, 1.2 + 2.6 * max(len(panes), 1)))
    panels = figure.subplots(max(len(panes), 1), 1, sharex=True, squeeze=False)[:, 0]
    columns = np.array([channel.place for channel in shown], dtype=np.int64)
    extremes = min_max(rows.values, columns, bucket) if len(shown) else np.zeros((0, 0, 2))
    row = rows.first - origin + bucket_places(extremes.shape[1], bucket).ravel()
    for k, channel in enumerate(shown):
        panels[panes.index(channel.unit.unit)].plot(
            row * hello.period_s * time.factor,
            extremes[k].ravel() * channel.unit.factor,
            color=LIGHT.curve(k),
            linewidth=1.0,
            label=channel.title,
        )
    for panel, unit in zip(panels, panes, strict=False):
        panel.set_ylabel(unit)
        panel.grid(alpha=0.3)
        panel.legend(fontsize=8, loc="upper right")
    panels[0].set_title(hello.machine)
    panels[-1].set_xlabel(f"time ({time.unit})")
    save(figure, path)
