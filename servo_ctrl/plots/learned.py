"""Picture of the learned functions: duration and amplitude of the pulse over the reverse acceleration."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from servo_ctrl.learning.pulse_functions import table
from servo_ctrl.learning.types import Learned
from servo_ctrl.plots.figures import COLOURS, save
from servo_ctrl.plots.matplotlib_agg import Axes, LogLocator, NullFormatter, plt

MARKERS = ("o", "s", "^", "D", "v", "P")


class LearnedAxis(NamedTuple):
    """What is drawn of one axis."""

    label: str
    learned: Learned
    amplitude_max_m_s: float


def plot_learned(path: Path, axes: Sequence[LearnedAxis], title: str) -> None:
    """Draw T*(a) and A*(a) as the control law reads them, with the learned points. Raises OSError.

    The amplitude of the second trapezoid, where there is one, is dashed with hollow points.
    """
    figure, (durations, amplitudes) = plt.subplots(1, 2, figsize=(12.4, 5.2), layout="constrained")
    for place, axis in enumerate(axes):
        colour, marker = COLOURS[place % len(COLOURS)], MARKERS[place % len(MARKERS)]
        rows = table(axis.learned)
        at_mm_s2 = rows[0] * 1e3
        durations.plot(at_mm_s2, rows[1] * 1e3, color=colour)
        _points(durations, axis.learned.durations, 1, axis.label, color=colour, marker=marker)
        amplitudes.plot(at_mm_s2, rows[2] * 1e3, color=colour)
        _points(amplitudes, axis.learned.amplitudes, 1, axis.label, color=colour, marker=marker)
        if axis.learned.trailing:
            amplitudes.plot(at_mm_s2, rows[5] * 1e3, color=colour, linestyle="--")
            label = f"{axis.label}: second trapezoid"
            _points(
                amplitudes,
                axis.learned.trailing,
                3,
                label,
                color=colour,
                marker=marker,
                markerfacecolor="white",
            )
    for limit_m_s in sorted({axis.amplitude_max_m_s for axis in axes}):
        amplitudes.axhline(
            limit_m_s * 1e3, color="0.3", linestyle=":", label=f"A_max {limit_m_s * 1e3:g} mm/s"
        )
    for panel, name in ((durations, "duration T* (ms)"), (amplitudes, "amplitude A* (mm/s)")):
        panel.set_xscale("log")
        panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        panel.xaxis.set_major_formatter("{x:g}")
        panel.xaxis.set_minor_formatter(NullFormatter())
        panel.set_xlabel("reverse acceleration a (mm/s²)")
        panel.set_ylabel(name)
        panel.grid(alpha=0.3, which="both")
    durations.set_ylim(bottom=0.0)
    figure.legend(*amplitudes.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=9)
    figure.suptitle(title)
    save(figure, path, tight=False)


def _points(panel: Axes, points: Sequence[Sequence[float]], column: int, label: str, **style: Any) -> None:
    at = np.array(points)
    panel.plot(at[:, 0] * 1e3, at[:, column] * 1e3, linestyle="", label=label, **style)
