"""Picture of a program: the path in the plane of its two longest axes, coloured by the speed along it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

mpl.use("Agg")  # files only: the daemon's machine may have no screen
from matplotlib import pyplot as plt
from matplotlib.collections import LineCollection

from servo_ctrl.telemetry.plots import save

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def plot_path(path: Path, names: Sequence[str], position_m: Array, speed_m_s: Array, title: str) -> None:
    """Draw positions (n, axes) with the speed (n,) there. One axis alone is drawn over its samples."""
    figure, panel = plt.subplots(figsize=(7.6, 6.4))
    if len(names) == 1:
        shown, labels = np.column_stack((np.arange(len(position_m)), position_m[:, 0] * 1e3)), ("sample", "")
    else:
        axes = np.sort(np.argsort(np.ptp(position_m, axis=0))[-2:])
        shown, labels = position_m[:, axes] * 1e3, (f"{names[axes[0]]} (mm)", names[axes[1]])
        panel.set_aspect("equal", adjustable="datalim")
    speeds = LineCollection(np.stack((shown[:-1], shown[1:]), axis=1).tolist(), cmap="viridis", linewidth=1.6)
    speeds.set_array(speed_m_s[1:] * 1e3)
    panel.add_collection(speeds)
    panel.autoscale_view()
    panel.plot(*shown[0], "o", color="0.2", markersize=5, label="start")
    figure.colorbar(speeds, label="speed along the path (mm/s)")
    panel.set_xlabel(labels[0])
    panel.set_ylabel(f"{labels[1] or names[0]} (mm)")
    panel.set_title(title)
    panel.grid(alpha=0.3)
    panel.legend(fontsize=8)
    save(figure, path)
