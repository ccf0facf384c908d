"""Residuals of models on a held-out recording over time, one row per axis."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.examples.real.judged import Judged
from servo_ctrl.files.whole_file import write_whole
from servo_ctrl.plots.matplotlib_agg import Figure

COLOURS = {"rigid": "tab:orange", "textbook": "tab:green", "written model": "tab:blue"}
LONGEST_S = 4.0
"""Drawn duration; in a longer one no detail would be visible."""


class Traces(NamedTuple):
    """One axis in the held-out recording."""

    axis: str
    one: Judged
    left_n: Mapping[str, Array]
    """Residual (n,) by model."""


def left_out(path: Path, title: str, source: str, traces: Sequence[Traces]) -> Path:
    """Draw the torque and the residuals of the models."""
    figure = Figure(figsize=(11.0, 1.5 + 3.0 * len(traces)), layout="constrained")
    figure.suptitle(f"{title}: {source}, which was left out")
    for axes, of in zip(np.atleast_1d(figure.subplots(len(traces), 1)), traces, strict=True):
        time_s = of.one.data.time_s
        seen = (time_s >= 0.2 * time_s[-1]) & (time_s <= 0.2 * time_s[-1] + LONGEST_S)
        axes.plot(time_s[seen], of.one.force_n[seen], color="0.7", lw=0.8, label="measured")
        for name, left_n in of.left_n.items():
            drawn = np.where(of.one.used, left_n, np.nan)[seen]
            rms = float(np.sqrt(np.mean(left_n[of.one.used] ** 2)))
            axes.plot(time_s[seen], drawn, color=COLOURS[name], lw=0.9, label=f"{name} leaves {rms:.3g} N m")
        axes.set(ylabel=f"{of.axis}: torque / N m", xlabel="time / s")
        axes.set_xlim(float(time_s[seen][0]), float(time_s[seen][-1]))
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, fontsize=8, frameon=False)
    write_whole(path, lambda temporary: figure.savefig(temporary, dpi=100, format="png"))
    return path
