"""Pictures of the friction study: a motion with and without compensation, and J over the time of a run."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from servo_ctrl.plots.contour_traces import ContourTrace, ErrorTrace
from servo_ctrl.plots.figures import COLOURS, draw_contour, save
from servo_ctrl.plots.matplotlib_agg import Figure

COLUMNS = 2


def plot_comparison(path: Path, panels: Mapping[str, Sequence[ErrorTrace]], window_s: float) -> None:
    """Draw tracking errors after a reversal, a panel for each title; positive = the axis lags.

    The shaded part is the monitoring window, over which the indicators are computed.
    """
    rows = -(-len(panels) // COLUMNS)
    figure = Figure(figsize=(5.2 * COLUMNS, 2.9 * rows))
    axes = figure.subplots(rows, COLUMNS, squeeze=False, sharex=True)
    for panel, (title, traces) in zip(axes.flat, panels.items(), strict=False):
        panel.axvspan(0.0, window_s * 1e3, color="0.93", zorder=0)
        for colour, trace in zip(COLOURS, traces, strict=False):
            time_ms, error_um = trace.since_reversal_s * 1e3, trace.error_m * 1e6
            panel.plot(time_ms, error_um, color=colour, linewidth=1.1, label=trace.label)
        panel.axhline(0.0, color="0.5", linewidth=0.8)
        panel.set_title(title, fontsize=10)
        panel.grid(alpha=0.3)
    for panel in axes[-1]:
        panel.set_xlabel("time since the reversal of the command (ms)")
    for row in axes:
        row[0].set_ylabel("error (um)")
    axes[0][0].legend(fontsize=8)
    save(figure, path)


def plot_contours(path: Path, panels: Mapping[str, Sequence[ContourTrace]]) -> None:
    """Draw contour errors as a ballbar does, a panel for each title, each with its own magnification."""
    rows = -(-len(panels) // COLUMNS)
    figure = Figure(figsize=(5.2 * COLUMNS, 5.2 * rows))
    axes = figure.subplots(rows, COLUMNS, squeeze=False, subplot_kw={"projection": "polar"})
    for panel in axes.flat[len(panels) :]:
        panel.set_visible(False)
    for panel, (title, traces) in zip(axes.flat, panels.items(), strict=False):
        division_um = draw_contour(panel, traces)
        panel.set_title(f"{title}, one division {division_um:g} um", fontsize=10)
    axes[0][0].legend(loc="lower left", bbox_to_anchor=(-0.12, -0.12), fontsize=8)
    save(figure, path)


class EvaluationTrace(NamedTuple):
    """J of one axis' reversals over the time of a run, lists of one length."""

    label: str
    time_s: Sequence[float]
    evaluation_m: Sequence[float]


def plot_evaluations(
    path: Path,
    traces: Sequence[EvaluationTrace],
    required_m: float,
    instants: Mapping[str, float],
    parts: Mapping[str, tuple[float, float]],
) -> None:
    """Draw J at every reversal, J_required, and the events at their instants (s), a panel for each part."""
    figure = Figure(figsize=(5.4 * len(parts), 4.4))
    panels = figure.subplots(1, len(parts), sharey=True, squeeze=False)
    for panel, (title, (begin_s, end_s)) in zip(panels[0], parts.items(), strict=True):
        for colour, trace in zip(COLOURS, traces, strict=False):
            evaluation_um = np.array(trace.evaluation_m) * 1e6
            panel.semilogy(
                trace.time_s, evaluation_um, color=colour, marker="o", ms=4, ls="", label=trace.label
            )
        panel.axhline(required_m * 1e6, color="0.3", ls="--", label=f"J_required {required_m * 1e6:g} um")
        for colour, (label, time_s) in zip(COLOURS[2:], instants.items(), strict=False):
            if begin_s <= time_s <= end_s:
                panel.axvline(time_s, color=colour, linewidth=1.4, label=f"{label} ({time_s:.0f} s)")
        margin_s = 0.02 * (end_s - begin_s)
        panel.set_xlim(begin_s - margin_s, end_s + margin_s)
        panel.set_title(title, fontsize=10)
        panel.set_xlabel("machine time (s)")
        panel.yaxis.set_major_formatter("{x:g}")
        panel.grid(alpha=0.3, which="both")
        panel.legend(fontsize=8, loc="upper left")
    panels[0][0].set_ylabel("J = mean |e| over Tm (um)")
    save(figure, path)
