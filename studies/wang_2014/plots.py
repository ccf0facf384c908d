"""Pictures of the positioning study: deviations over the repeats, over the travel, and after an arrival."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.plots.figures import COLOURS, save
from servo_ctrl.plots.matplotlib_agg import Axes, Figure

UM = 1e6
DIRECTIONS = (("up", "o", "full"), ("down", "s", "none"))
"""Name, marker and its filling, in the order of the last axis of the deviations."""


class DeviationTrace(NamedTuple):
    """Deviations (runs, targets, 2) of one stage at the targets (targets,)."""

    label: str
    colour: int
    """Place in the palette: a stage has one colour in all panels."""
    target_mm: Array
    deviation_m: Array


class ArrivalTrace(NamedTuple):
    """An axis after the arrival of its command, (n,) each; deviations from the target."""

    label: str
    colour: int
    since_arrival_s: Array
    scale_m: Array
    correction_m: Array


def plot_repeats(path: Path, panels: Mapping[str, Sequence[DeviationTrace]]) -> None:
    """Draw the deviation of every repeat at the only target, a panel for each title."""
    figure, axes = _panels(len(panels))
    for panel, (title, traces) in zip(axes.flat, panels.items(), strict=False):
        for trace, direction, style in _lines(traces):
            repeats = np.arange(1, len(trace.deviation_m) + 1)
            deviation_um = trace.deviation_m[:, 0, direction] * UM
            panel.plot(repeats, deviation_um, markersize=3.5, linewidth=0.7, **style)
        _label(panel, title, "repeat", "interferometer")
    save(figure, path)


def plot_targets(path: Path, panels: Mapping[str, Sequence[DeviationTrace]]) -> None:
    """Draw mean and range of the deviations over the targets, in both directions, a panel for each title."""
    figure, axes = _panels(len(panels))
    for panel, (title, traces) in zip(axes.flat, panels.items(), strict=False):
        for trace, direction, style in _lines(traces):
            deviation_um = trace.deviation_m[:, :, direction] * UM
            mean = deviation_um.mean(axis=0)
            target_mm = trace.target_mm + (0.5 if direction else -0.5)  # side by side
            bars = [mean - deviation_um.min(axis=0), deviation_um.max(axis=0) - mean]
            panel.errorbar(target_mm, mean, yerr=bars, markersize=4.0, linewidth=0.9, elinewidth=0.8, **style)
        _label(panel, title, "target (mm); bars: all repeats", "interferometer")
    save(figure, path)


def _lines(traces: Sequence[DeviationTrace]) -> Iterator[tuple[DeviationTrace, int, dict[str, Any]]]:
    """Yield each trace in both directions, with the style of its line."""
    for trace in traces:
        for direction, (name, marker, fill) in enumerate(DIRECTIONS):
            label, colour = f"{trace.label}, {name}", COLOURS[trace.colour]
            yield trace, direction, {"color": colour, "marker": marker, "fillstyle": fill, "label": label}


def plot_arrivals(path: Path, panels: Mapping[str, ArrivalTrace]) -> None:
    """Draw the deviation by the scale after an arrival, and the correction (broken line)."""
    figure = Figure(figsize=(6.2 * len(panels), 4.6))
    axes = figure.subplots(1, len(panels), squeeze=False, sharey=True)
    for panel, (title, trace) in zip(axes[0], panels.items(), strict=True):
        time_ms, colour = trace.since_arrival_s * 1e3, COLOURS[trace.colour]
        panel.plot(time_ms, trace.scale_m * UM, color=colour, linewidth=0.7, label=trace.label)
        panel.plot(time_ms, trace.correction_m * UM, color=colour, ls="--", label="correction")
        _label(panel, title, "time since the command arrived (ms)", "scale")
    save(figure, path)


def _panels(count: int) -> tuple[Figure, Any]:
    """Return a figure with `count` panels, two in a row."""
    columns = min(count, 2)
    rows = -(-count // columns)
    figure = Figure(figsize=(6.2 * columns, 4.6 * rows))
    axes = figure.subplots(rows, columns, squeeze=False)
    for panel in axes.flat[count:]:
        panel.set_visible(False)
    return figure, axes


def _label(panel: Axes, title: str, abscissa: str, by: str) -> None:
    panel.axhline(0.0, color="0.5", linewidth=0.8)
    panel.set_title(title, fontsize=10)
    panel.set(xlabel=abscissa, ylabel=f"deviation by the {by} (um)")
    panel.grid(alpha=0.3)
    panel.legend(fontsize=7)
