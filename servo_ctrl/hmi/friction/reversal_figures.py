"""Indicators of the reversals as plotly figures and texts."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

from servo_ctrl.commands.local_messages import Reversal
from servo_ctrl.hmi.shell.palette import theme_of
from servo_ctrl.hmi.shell.plots import curve, figure, horizontal_line, plot_layout
from servo_ctrl.hmi.shell.units import UnitSystem

MEAN = "error_mean_m"
"""J of Feng et al. 2015, section 5; the one that J_required bounds."""
INDICATORS = {
    MEAN: "J (mean error)",
    "error_rms_m": "error RMS",
    "error_peak_m": "error peak",
    "contour_peak_m": "contour peak",
}
SYMBOLS = ("circle", "square", "diamond", "triangle-up")
"""By axis, so that axes are told apart without colour too."""
DIRECTIONS = ("\N{MINUS SIGN}", "+")
"""Of the motion after a reversal."""


def indicator_figure(
    reversals: Sequence[Reversal],
    axes: Sequence[str],
    indicator: str,
    *,
    required_m: float,
    period_s: float,
    units: UnitSystem,
    dark: bool,
) -> dict[str, Any]:
    """One indicator of each reversal over the time of the run, one curve an axis; with J_required for J."""
    theme, unit = theme_of(dark=dark), units.error
    data = []
    for number, axis in enumerate(dict.fromkeys([*axes, *(reversal.axis for reversal in reversals)])):
        found = [reversal for reversal in reversals if reversal.axis == axis]
        time_s = [reversal.report.cycle * period_s for reversal in found]
        values = [_scaled(getattr(reversal.report, indicator), unit.factor) for reversal in found]
        style = {"symbol": SYMBOLS[number % len(SYMBOLS)], "size": 7}
        line = {"color": theme.curve(number), "width": 1}
        data.append(curve(f"axis {axis}", time_s, values, "lines+markers", line=line, marker=style))
    layout = plot_layout("time of the run (s)", f"{INDICATORS[indicator]} ({unit.unit})", dark=dark)
    layout["yaxis"]["rangemode"] = "tozero"
    if indicator == MEAN:
        layout |= horizontal_line("J required", required_m * unit.factor, theme.grey)
    return figure(data, layout, revision=indicator + units.name)


def error_figure(reversals: Sequence[Reversal], units: UnitSystem, *, dark: bool) -> dict[str, Any]:
    """The error over the monitoring time after some reversals, one curve each."""
    theme = theme_of(dark=dark)
    data = []
    for number, reversal in enumerate(reversals):
        direction = reversal.report.direction
        time_ms = [sample * reversal.period_s * 1e3 for sample in range(len(reversal.error_m))]
        error = [_scaled(value, units.error.factor) for value in reversal.error_m]
        line = {"color": theme.curve(number), "dash": "solid" if direction > 0 else "dash"}
        data.append(curve(f"axis {reversal.axis}, {DIRECTIONS[direction > 0]}", time_ms, error, line=line))
    layout = plot_layout("since the reversal (ms)", f"lag ({units.error.unit})", dark=dark)
    return figure(data, layout, revision=units.name)


def _scaled(value: float, factor: float) -> float | None:
    """None, which a plot leaves out, for what is no number."""
    return value * factor if math.isfinite(value) else None


def newest_of_each(reversals: Iterable[Reversal]) -> list[Reversal]:
    """The last reversal of each axis and direction."""
    newest = {(reversal.axis, reversal.report.direction): reversal for reversal in reversals}
    return [newest[key] for key in sorted(newest, key=lambda key: (key[0], -key[1]))]
