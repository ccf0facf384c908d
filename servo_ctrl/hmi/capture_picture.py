"""What the scope shows as a picture in a file."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from servo_ctrl.hmi.capture_look import panes_of, time_scale
from servo_ctrl.hmi.palette import LINES_LIGHT
from servo_ctrl.telemetry.min_max import bucket_rows, min_max
from servo_ctrl.telemetry.plots import save

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from servo_ctrl.config.local_messages import Hello
    from servo_ctrl.hmi.capture_look import Trace
    from servo_ctrl.hmi.capture_stream import Rows

PICTURE_WIDTH = 1200


def draw_capture(path: Path, rows: Rows, traces: Sequence[Trace], origin: int, hello: Hello) -> None:
    """The traces by panes, as the scope shows them; time zero at row `origin`. Raises OSError."""
    panes = panes_of(traces)
    count = len(rows.values)
    bucket = bucket_rows(count, PICTURE_WIDTH)
    time = time_scale(count * hello.period_s)
    figure = Figure(figsize=(10.0, 1.2 + 2.6 * max(len(panes), 1)))
    panels = figure.subplots(max(len(panes), 1), 1, sharex=True, squeeze=False)[:, 0]
    columns = np.array([trace.place for trace in traces], dtype=np.int64)
    found = min_max(rows.values, columns, bucket) if len(traces) else np.zeros((0, 0, 2))
    place = (
        np.arange(found.shape[1])[:, np.newaxis] * float(bucket) + (bucket - 1) * np.array([0.25, 0.75])
    ).ravel()
    time_of = (place + rows.first - origin) * hello.period_s * time.factor
    for k, trace in enumerate(traces):
        panel = panels[panes.index(trace.scale.unit)]
        colour = LINES_LIGHT[k % len(LINES_LIGHT)]
        panel.plot(
            time_of, found[k].ravel() * trace.scale.factor, color=colour, linewidth=1.0, label=trace.name
        )
    for panel, unit in zip(panels, panes, strict=False):
        panel.set_ylabel(unit)
        panel.grid(alpha=0.3)
        panel.legend(fontsize=8, loc="upper right")
    panels[0].set_title(hello.machine)
    panels[-1].set_xlabel(f"time ({time.unit})")
    save(figure, path)
