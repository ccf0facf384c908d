"""Pictures of what was learned: the pulse over the reverse acceleration, the screw over the travel."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from servo_ctrl.learning.pulse_functions import table
from servo_ctrl.learning.reversal_waveform import LoopModel, WaveformLearned, rest_travels_m
from servo_ctrl.learning.screw import ScrewLearned
from servo_ctrl.learning.types import Learned
from servo_ctrl.plots.figures import COLOURS, save
from servo_ctrl.plots.matplotlib_agg import Axes, Figure, LogLocator, NullFormatter
from servo_ctrl.units import MM, UM

MARKERS = ("o", "s", "^", "D", "v", "P")


class LearnedAxis(NamedTuple):
    """Pulse functions of one axis."""

    label: str
    learned: Learned
    amplitude_max_m_s: float


def plot_learned(path: Path, axes: Sequence[LearnedAxis], title: str) -> None:
    """Draw T*(a) and A*(a) as the control law reads them, with the learned points. Raises OSError.

    The amplitude of the second trapezoid, where there is one, is dashed with hollow points.
    """
    figure = Figure(figsize=(12.4, 5.2), layout="constrained")
    durations, amplitudes = figure.subplots(1, 2)
    for axis, colour, marker in zip(axes, cycle(COLOURS), cycle(MARKERS), strict=False):
        rows = table(axis.learned)
        at_mm_s2 = rows[0] * 1e3
        style = {"color": colour, "marker": marker}
        durations.plot(at_mm_s2, rows[1] * 1e3, color=colour)
        _points(durations, axis.learned.durations, 1, axis.label, **style)
        amplitudes.plot(at_mm_s2, rows[2] * 1e3, color=colour)
        _points(amplitudes, axis.learned.amplitudes, 1, axis.label, **style)
        if axis.learned.trailing:
            amplitudes.plot(at_mm_s2, rows[5] * 1e3, color=colour, linestyle="--")
            label = f"{axis.label}: second trapezoid"
            _points(amplitudes, axis.learned.trailing, 3, label, markerfacecolor="white", **style)
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


def plot_screws(path: Path, screws: Mapping[str, ScrewLearned], title: str) -> None:
    """Draw the error of each screw as the control law reads it, and its lost motion with the mean.

    `screws`: label -> what was learned. Raises OSError.
    """
    figure = Figure(figsize=(9.6, 7.2), layout="constrained")
    errors, lost = figure.subplots(2, 1, sharex=True)
    for colour, (label, learned) in zip(cycle(COLOURS), screws.items(), strict=False):
        position_m, error_m, lost_m = np.array(learned.points).T
        errors.plot(position_m / MM, error_m / UM, color=colour, linewidth=1.0, label=label)
        lost.plot(position_m / MM, lost_m / UM, color=colour, linewidth=1.0)
        mean_um = learned.lost_motion_m / UM
        lost.axhline(mean_um, color=colour, linestyle="--", label=f"{label}: mean {mean_um:.2f} µm")
    errors.set_ylabel("scale less encoder (µm)")
    lost.set_ylabel("lost motion (µm)")
    lost.set_ylim(bottom=0.0)
    lost.set_xlabel("position of the table (mm)")
    for panel in (errors, lost):
        panel.grid(alpha=0.3)
        panel.legend(fontsize=9)
    figure.suptitle(title)
    save(figure, path, tight=False)


def plot_waveforms(path: Path, axes: Mapping[str, WaveformLearned], loop: LoopModel, title: str) -> None:
    """Draw the waveforms of each axis, one line for each reverse acceleration; beside them what rests add.

    `axes`: label -> what was learned. Raises OSError.
    """
    columns = 2 if any(learned.rests for learned in axes.values()) else 1
    figure = Figure(figsize=(9.6 * columns, 3.6 * len(axes)), layout="constrained")
    panels = figure.subplots(len(axes), columns, sharex="col", squeeze=False)
    for row, (label, learned) in zip(panels, axes.items(), strict=True):
        panel, *beside = row
        for rests in beside:
            _draw_rests(rests, learned, loop)
        for a_m_s2, wave_n in zip(learned.accelerations_m_s2, learned.waves_n, strict=True):
            time_ms = 1e3 * (np.arange(len(wave_n)) * loop.period_s - loop.ahead_s)
            panel.plot(time_ms, wave_n, linewidth=1.0, label=f"{a_m_s2 / MM:.3g} mm/s²")
        panel.set_title(label, fontsize=10)
        panel.set_ylabel("force (N)")
        panel.axvline(0.0, color="0.5", linewidth=0.8)
        panel.grid(alpha=0.3)
        panel.legend(fontsize=8, ncols=4)
    panels[-1, 0].set_xlabel("time after the reversal (ms)")
    figure.suptitle(title)
    save(figure, path, tight=False)


def _draw_rests(panel: Axes, learned: WaveformLearned, loop: LoopModel) -> None:
    for number, (rest_s, *forces_n) in enumerate(learned.rests):
        for kind, style, force_n in zip(("onward", "turned"), ("-", "--"), forces_n, strict=True):
            travel_um = rest_travels_m(loop, len(force_n)) / UM
            label = f"{rest_s:.3g} s, {kind}"
            panel.plot(travel_um, force_n, style, color=f"C{number}", linewidth=1.0, label=label)
    panel.set_xscale("log")
    panel.set_xlim(left=0.1)
    panel.set_xlabel("travel behind a rest (µm)")
    panel.grid(alpha=0.3)
    panel.legend(fontsize=8, ncols=2)


def _points(panel: Axes, points: Sequence[Sequence[float]], column: int, label: str, **style: Any) -> None:
    at = np.array(points)
    panel.plot(at[:, 0] * 1e3, at[:, column] * 1e3, linestyle="", label=label, **style)
