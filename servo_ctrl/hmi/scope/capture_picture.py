"""Draws what the scope shows into a PNG file."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.hmi.charts.frames import bucket_places
from servo_ctrl.hmi.scope.appearance import ShownChannel, panes_of, time_unit
from servo_ctrl.hmi.scope.stream import CapturedRows
from servo_ctrl.hmi.shell.plots import LIGHT
from servo_ctrl.plots.figures import save
from servo_ctrl.plots.matplotlib_agg import Figure
from servo_ctrl.recording.min_max import bucket_rows, min_max

WIDTH_PX = 1200


def draw_capture(
    path: Path, rows: CapturedRows, shown: Sequence[ShownChannel], hello: Hello, origin: int
) -> None:
    """Draw the channels in panes by unit, with time zero at row `origin`. Raises OSError."""
    panes, count = panes_of(shown), len(rows.values)
    bucket = bucket_rows(count, WIDTH_PX)
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
            label=channel.name,
        )
    for panel, unit in zip(panels, panes, strict=False):
        panel.set_ylabel(unit)
        panel.grid(alpha=0.3)
        panel.legend(fontsize=8, loc="upper right")
    panels[0].set_title(hello.machine)
    panels[-1].set_xlabel(f"time ({time.unit})")
    save(figure, path)
