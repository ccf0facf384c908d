"""Picture of a program: the path in the plane of its two longest axes, coloured by the speed along it."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from servo_ctrl.plots.figures import save
from servo_ctrl.plots.matplotlib_agg import Figure, LineCollection


def plot_path(
    path: Path,
    names: Sequence[str],
    position_m: Array,
    speed_m_s: Array,
    rapid: NDArray[np.bool_],
    title: str,
) -> None:
    """Draw a path of positions (n, axes) with the speed along it (n,); one axis is drawn over its samples.

    Rapid moves, where `rapid` (n,) is true, are grey, so that the colours are those of the feed.
    """
    figure = Figure(figsize=(7.6, 6.4))
    panel = figure.subplots()
    if len(names) == 1:
        shown = np.column_stack((np.arange(len(position_m)), position_m[:, 0] * 1e3))
        panel.set_xlabel("sample")
        panel.set_ylabel(f"{names[0]} (mm)")
    else:
        first, second = sorted(np.argsort(np.ptp(position_m, axis=0))[-2:].tolist())
        shown = position_m[:, [first, second]] * 1e3
        panel.set_xlabel(f"{names[first]} (mm)")
        panel.set_ylabel(f"{names[second]} (mm)")
        panel.set_aspect("equal", adjustable="datalim")
    pieces, rapid = np.stack((shown[:-1], shown[1:]), axis=1), rapid[1:]
    panel.add_collection(LineCollection(pieces[rapid].tolist(), color="0.75", linewidth=1.0))
    coloured = LineCollection(pieces[~rapid].tolist(), cmap="viridis", linewidth=2.0)
    coloured.set_array(speed_m_s[1:][~rapid] * 1e3)
    panel.add_collection(coloured)
    panel.autoscale_view()
    panel.plot(*shown[0], "o", color="0.2", markersize=5, label="start")
    if not rapid.all():
        figure.colorbar(coloured, label="speed along the path at feed (mm/s); rapid moves are grey")
    panel.set_title(title)
    panel.grid(alpha=0.3)
    panel.legend(fontsize=8)
    save(figure, path)
