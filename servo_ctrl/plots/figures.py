"""Pictures of a run by matplotlib: errors at the reversals, and the contour as a ballbar shows it."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np

from kernels.arrays import Array
from servo_ctrl.files.whole_file import write_whole
from servo_ctrl.plots.contour_traces import ContourTrace, ErrorTrace, round_division
from servo_ctrl.plots.matplotlib_agg import Figure, PolarAxes

# Okabe and Ito's palette, distinguished by colour-blind readers too
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
DPI = 120


def plot_reversals(path: Path, traces_by_axis: Mapping[str, Sequence[ErrorTrace]], window_s: float) -> None:
    """Draw each axis' tracking error (command minus scale, um) against the time since its reversal.

    The shaded part is the monitoring window over which the indicators are taken.
    """
    figure = Figure(figsize=(6.2 * len(traces_by_axis), 4.4))
    axes = figure.subplots(1, len(traces_by_axis), squeeze=False, sharey=True)
    for panel, (axis, traces) in zip(axes[0], traces_by_axis.items(), strict=True):
        panel.axvspan(0.0, window_s * 1e3, color="0.92", zorder=0, label=f"window {window_s * 1e3:.0f} ms")
        for colour, trace in zip(COLOURS, traces, strict=False):
            panel.plot(trace.since_reversal_s * 1e3, trace.error_m * 1e6, color=colour, label=trace.label)
        panel.axhline(0.0, color="0.5", linewidth=0.8)
        panel.set_title(f"{axis} axis at its reversal")
        panel.set_xlabel("time since the reversal of the command (ms)")
        panel.grid(alpha=0.3)
        panel.legend(fontsize=8)
    axes[0][0].set_ylabel("tracking error, command - scale (µm)")
    save(figure, path)


def plot_contour(path: Path, traces: Sequence[ContourTrace], radius_m: float) -> None:
    """Draw the contour error as a ballbar does: polar, the error magnified about the commanded circle."""
    figure = Figure(figsize=(6.6, 6.6))
    panel = cast("PolarAxes", figure.add_subplot(projection="polar"))
    division_um = draw_contour(panel, traces)
    panel.set_title(f"contour error, R = {radius_m * 1e3:g} mm, one division {division_um:g} µm")
    panel.legend(loc="lower left", bbox_to_anchor=(-0.12, -0.12), fontsize=8)
    save(figure, path)


def draw_contour(panel: PolarAxes, traces: Sequence[ContourTrace]) -> float:
    """Draw radial errors about the commanded circle; return what one division is, micrometres."""
    largest_m = max(float(np.abs(trace.radial_error_m).max()) for trace in traces)
    division_m = round_division(largest_m)
    for colour, trace in zip(COLOURS, traces, strict=False):
        angle, error = np.append(trace.angle_rad, trace.angle_rad[:1]), trace.radial_error_m
        panel.plot(angle, np.append(error, error[:1]) * 1e6, color=colour, linewidth=1.0, label=trace.label)
    panel.plot(np.linspace(0.0, 2.0 * np.pi, 361), np.zeros(361), color="0.2", linewidth=1.0)
    panel.set_rlim(-4.0 * division_m * 1e6, 2.0 * division_m * 1e6)
    panel.set_rticks([division_m * 1e6 * k for k in (-2, -1, 0, 1, 2)])
    panel.set_rlabel_position(22.5)
    return division_m * 1e6


class Comparison(NamedTuple):
    """A quantity simulated and measured, arrays of one length; its difference has a finer unit."""

    quantity: str
    unit: str
    simulated: Array
    measured: Array
    difference_unit: str
    difference_factor: float


def plot_against_measurement(path: Path, time_s: Array, rows: Sequence[Comparison], title: str) -> None:
    """Draw each quantity simulated and measured over time, and below it the difference in its own scale."""
    figure = Figure(figsize=(9.0, 4.0 * len(rows)))
    axes = figure.subplots(2 * len(rows), 1, sharex=True)
    for row, panel, below in zip(rows, axes[::2], axes[1::2], strict=True):
        panel.plot(time_s, row.measured, color=COLOURS[0], linewidth=0.9, label="measured")
        panel.plot(time_s, row.simulated, color=COLOURS[1], linewidth=0.9, linestyle="--", label="simulated")
        panel.set_ylabel(f"{row.quantity} ({row.unit})")
        panel.legend(fontsize=8, ncols=2)
        difference = (row.simulated - row.measured) * row.difference_factor
        below.plot(time_s, difference, color=COLOURS[2], linewidth=0.7)
        below.set_ylabel(f"difference ({row.difference_unit})")
        panel.grid(alpha=0.3)
        below.grid(alpha=0.3)
    axes[0].set_title(title)
    axes[-1].set_xlabel("time (s)")
    save(figure, path)


def save(figure: Figure, path: Path, *, tight: bool = True) -> None:
    """Write a picture whole; `tight` off: it has a layout of its own. Raises OSError."""
    if tight:
        figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, lambda temporary: figure.savefig(temporary, dpi=DPI, format="png"))
