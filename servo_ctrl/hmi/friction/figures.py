"""Reversals, learned functions and versions in the store as plotly figures, texts and table rows."""

import math
import statistics
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal

import numpy as np

from servo_ctrl.commands.local_messages import Reversal
from servo_ctrl.control.waveform_table import AHEAD_S
from servo_ctrl.hmi.languages.texts import tr, word
from servo_ctrl.hmi.shell.plots import Look, curve, figure, horizontal_line, plot_layout
from servo_ctrl.hmi.shell.units import UnitSystem
from servo_ctrl.learned.store import VersionEntry
from servo_ctrl.learning.pulse_functions import table
from servo_ctrl.learning.reversal_waveform import WaveformLearned
from servo_ctrl.learning.types import Learned

MEAN = "error_mean_m"
"""J of Feng et al. 2015, section 5; the one that J_required bounds."""
INDICATORS = {
    MEAN: word("J (mean error)"),
    "error_rms_m": word("error RMS"),
    "error_peak_m": word("error peak"),
    "contour_peak_m": word("contour peak"),
}
SYMBOLS = ("circle", "square", "diamond", "triangle-up")
"""By axis: symbols distinguish the axes without colour."""
DIRECTIONS = ("\N{MINUS SIGN}", "+")
"""Of the motion after a reversal."""
ARROW = "\N{RIGHTWARDS ARROW}"
MEDIAN_REVERSALS, MIN_REVERSALS, OUTLIER_RATIO = 8, 3, 2.0
"""Bound the reversals of the median, from above and below, and the ratio of J to it that makes no outlier;
chosen."""
MIN_SCREW_POINTS = 2
"""Bounds the points of a screw table that are drawn as a line from below."""


def indicator_figure(
    reversals: Sequence[Reversal], axes: Sequence[str], indicator: str, required_m: float, look: Look
) -> dict[str, Any]:
    """Return one indicator of each reversal over the run time, one curve an axis; with J_required for J."""
    theme, unit = look.theme, look.units.error
    data = []
    for number, axis in enumerate(dict.fromkeys([*axes, *(reversal.axis for reversal in reversals)])):
        found = [reversal for reversal in reversals if reversal.axis == axis]
        time_s = [reversal.report.cycle * reversal.period_s for reversal in found]
        values = [_scaled(getattr(reversal.report, indicator), unit.factor) for reversal in found]
        symbol = SYMBOLS[number % len(SYMBOLS)]
        is_outlier = outliers(values)
        style = {
            "symbol": [f"{symbol}-open" if outlier else symbol for outlier in is_outlier],
            "size": [12 if outlier else 7 for outlier in is_outlier],
        }
        line = {"color": theme.curve(number), "width": 1}
        data.append(
            curve(tr("axis {axis}", axis=axis), time_s, values, "lines+markers", line=line, marker=style)
        )
    layout = plot_layout(tr("time of the run (s)"), f"{tr(INDICATORS[indicator])} ({unit.unit})", theme)
    layout["yaxis"]["rangemode"] = "tozero"
    if indicator == MEAN:
        layout |= horizontal_line(tr("J required"), required_m * unit.factor, theme.grey)
    return figure(data, layout, revision=indicator + look.units.name)


def outliers(values: Sequence[float | None]) -> list[bool]:
    """Return which values exceed OUTLIER_RATIO times the median of the previous ones."""
    found = []
    for place, value in enumerate(values):
        before = [one for one in values[max(place - MEDIAN_REVERSALS, 0) : place] if one is not None]
        found.append(
            value is not None
            and len(before) >= MIN_REVERSALS
            and value > OUTLIER_RATIO * statistics.median(before)
        )
    return found


def error_figure(reversals: Sequence[Reversal], look: Look) -> dict[str, Any]:
    """Return the error over the monitoring time after some reversals, one curve each."""
    units, theme = look
    data = []
    for number, reversal in enumerate(reversals):
        direction = reversal.report.direction
        time_ms = [sample * reversal.period_s * 1e3 for sample in range(len(reversal.error_m))]
        error = [_scaled(value, units.error.factor) for value in reversal.error_m]
        line = {"color": theme.curve(number), "dash": "solid" if direction > 0 else "dash"}
        name = f"{tr('axis {axis}', axis=reversal.axis)}, {DIRECTIONS[direction > 0]}"
        data.append(curve(name, time_ms, error, line=line))
    layout = plot_layout(tr("since the reversal (ms)"), tr("lag ({unit})", unit=units.error.unit), theme)
    return figure(data, layout, revision=units.name)


def _scaled(value: float, factor: float) -> float | None:
    """Return the scaled value; None, which a plot leaves out, where it is not finite."""
    return value * factor if math.isfinite(value) else None


def newest_of_each(reversals: Iterable[Reversal]) -> list[Reversal]:
    """Return the last reversal of each axis and direction."""
    newest = {(reversal.axis, reversal.report.direction): reversal for reversal in reversals}
    return [newest[key] for key in sorted(newest, key=lambda key: (key[0], -key[1]))]


def pulse_figure(
    functions: Mapping[str, Learned], part: Literal["durations", "amplitudes"], look: Look
) -> dict[str, Any]:
    """Return the pulse duration T*(a) or amplitude A*(a) of the control law, and the learned points.

    `functions` are those of the versions by name.
    """
    units, theme = look
    unit, factor, title = units.acceleration, 1e3, tr("duration T* (ms)")
    if part == "amplitudes":
        factor, title = units.velocity.factor, tr("amplitude A* ({unit})", unit=units.velocity.unit)
    data: list[dict[str, Any]] = []
    for number, (name, learned) in enumerate(functions.items()):
        colour = theme.curve(number)
        line = {"color": colour, "dash": ("solid", "dash")[number % 2]}
        marker = {"color": colour, "size": 8, "symbol": ("circle", "square-open")[number % 2]}
        acceleration, durations, amplitudes = table(learned)[:3]
        values = durations if part == "durations" else amplitudes
        points = np.array(getattr(learned, part)) * (unit.factor, factor)
        x, y = (acceleration * unit.factor).tolist(), (values * factor).tolist()
        data.append(curve(name, x, y, legendgroup=name, line=line))
        x, y = points.T.tolist()
        data.append(curve(name, x, y, "markers", legendgroup=name, showlegend=False, marker=marker))
    layout = plot_layout(tr("reverse acceleration a ({unit})", unit=unit.unit), title, theme)
    layout["xaxis"]["type"] = "log"
    layout["yaxis"]["rangemode"] = "tozero"
    return figure(data, layout, revision=units.name)


def screw_figure(points: Sequence[tuple[float, float, float]], look: Look) -> dict[str, Any]:
    """Return the screw error and the lost motion over the travel; empty without a table."""
    if len(points) < MIN_SCREW_POINTS:
        return figure([], {}, revision="")
    units, theme = look
    position_m, error_m, lost_motion_m = zip(*points, strict=True)
    x = [value * units.length.factor for value in position_m]
    data = []
    curves = ((tr("scale less encoder"), error_m, "solid"), (tr("lost motion"), lost_motion_m, "dash"))
    for number, (name, values_m, dash) in enumerate(curves):
        y = [value * units.error.factor for value in values_m]
        data.append(curve(name, x, y, line={"color": theme.curve(number), "dash": dash}))
    layout = plot_layout(tr("position ({unit})", unit=units.length.unit), units.error.unit, theme)
    return figure(data, layout, revision=units.name)


def waveform_figure(learned: WaveformLearned | None, period_s: float, look: Look) -> dict[str, Any]:
    """Return the force around a reversal, one curve a reverse acceleration; empty without a waveform."""
    if learned is None or not learned.waves_n:
        return figure([], {}, revision="")
    units, theme = look
    data = []
    rows = zip(learned.accelerations_m_s2, learned.waves_n, strict=True)
    for number, (a_m_s2, wave_n) in enumerate(rows):
        time_ms = [1e3 * (sample * period_s - AHEAD_S) for sample in range(len(wave_n))]
        line = {"color": theme.curve(number), "dash": ("solid", "dash")[number % 2]}
        data.append(curve(units.acceleration.with_unit(a_m_s2), time_ms, list(wave_n), line=line))
    layout = plot_layout(tr("since the reversal (ms)"), tr("force (N)"), theme)
    return figure(data, layout, revision=units.name)


def version_rows(entries: Sequence[VersionEntry], units: UnitSystem) -> list[dict[str, Any]]:
    """Return the versions of an axis as rows of a table, the newest first; `gain`: J before and after."""
    rows = []
    for entry in reversed(entries):
        name = tr("{version}, in use", version=entry.version) if entry.in_use else str(entry.version)
        row: dict[str, Any] = {"version": entry.version, "name": name, "problem": entry.problem}
        if entry.result is not None:
            learned, error = entry.result.learned, units.error
            row |= {
                "learned_at": f"{entry.result.learned_at[:16].replace('T', ' ')} UTC",
                "learner": learned.learner,
                "strokes": str(learned.strokes),
                "gain": f"{error.text(learned.before_m)} {ARROW} {error.with_unit(learned.after_m)}",
            }
        rows.append(row)
    return rows


def roll_back_target(entries: Sequence[VersionEntry]) -> int | None:
    """Return the version that a roll back puts into use, 0: no version; None if none is in use now."""
    in_use = next((entry.version for entry in entries if entry.in_use), None)
    if in_use is None:
        return None
    usable = [entry.version for entry in entries if entry.version < in_use and not entry.problem]
    return max(usable, default=0)
