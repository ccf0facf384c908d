"""The section of the reversals evaluated by the run, compared with J_required."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from servo_ctrl.recording.min_max import thinned
from servo_ctrl.recording.reversal_log import REVERSALS_FILE
from servo_ctrl.report.axis_section import STRETCHES, UM, in_um
from servo_ctrl.report.content import LevelLine, ReportPicture, ReportSection, ReportTable, Series
from servo_ctrl.report.recorded_run import RecordedRun

HEADING = "Reversals"
MOST_ROWS = 40
"""Bounds the table of single reversals to the newest."""


def reversal_section(run: RecordedRun) -> ReportSection:
    """Return the indicators at the reversals, or the reason why there are none."""
    if run.reversals:
        return ReportSection(HEADING, (_words(run),), (_summary(run), _picture(run), _newest(run.reversals)))
    reason = "No reversal was evaluated: none in the program, or all were cut off."
    if run.reversals is None:
        reason = f"The recording has no {REVERSALS_FILE}: reversals were not monitored."
    return ReportSection(HEADING, (reason,))


def _words(run: RecordedRun) -> str:
    monitoring = run.header.monitoring
    if monitoring is None:
        return "This recording does not tell J_required."
    return (
        f"J is the mean error over {monitoring.window_s * 1e3:.0f} ms after the reversal. Required are "
        f"{in_um(monitoring.required_m)} µm at most."
    )


def _summary(run: RecordedRun) -> ReportTable:
    rows = []
    for axis in run.axes:
        of_axis = [entry for entry in run.reversals or () if entry["axis"] == axis.name]
        if not of_axis:
            rows.append((axis.name, "0", *("-",) * 7))
            continue
        evaluation_m = np.array([entry["error_mean_m"] for entry in of_axis])
        required_m = run.header.monitoring.required_m if run.header.monitoring else float("nan")
        above = np.count_nonzero(evaluation_m > required_m)
        rows.append(
            (
                axis.name,
                str(len(of_axis)),
                in_um(float(evaluation_m.mean())),
                in_um(float(evaluation_m.max())),
                in_um(float(evaluation_m[-1])),
                f"{100.0 * above / len(of_axis):.0f}" if np.isfinite(required_m) else "-",
                in_um(max(entry["error_peak_m"] for entry in of_axis)),
                in_um(max(entry["contour_peak_m"] for entry in of_axis)),
                "yes" if of_axis[-1].get("due") else "no",
            )
        )
    head = (
        *("axis", "reversals", "J mean µm", "J largest µm", "J last µm", "above J_required %"),
        *("peak error µm", "peak contour µm", "learning due"),
    )
    return ReportTable("Indicators by axis", head, tuple(rows))


def _picture(run: RecordedRun) -> ReportPicture:
    series = []
    for axis in run.axes:
        of_axis = [entry for entry in run.reversals or () if entry["axis"] == axis.name]
        if of_axis:
            x, y = (np.array([entry[key] for entry in of_axis]) for key in ("time_s", "error_mean_m"))
            series.append(Series(f"axis {axis.name}", *thinned(x, y * UM, STRETCHES)))
    monitoring = run.header.monitoring
    levels = () if monitoring is None else (LevelLine("J required", monitoring.required_m * UM),)
    return ReportPicture(
        name="reversals",
        heading="J of each reversal",
        x_label="time (s)",
        y_label="J (µm)",
        series=tuple(series),
        levels=levels,
        kind="points",
    )


def _newest(reversals: Sequence[dict[str, Any]]) -> ReportTable:
    shown = reversals[-MOST_ROWS:]
    rows = tuple(
        (
            entry["axis"],
            f"{entry['time_s']:.3f}",
            "+" if entry.get("direction", 1) > 0 else "-",
            f"{entry['acceleration_m_s2'] * 1e3:.2f}",
            *(in_um(entry[key]) for key in ("error_mean_m", "error_peak_m", "error_rms_m", "contour_peak_m")),
        )
        for entry in shown
    )
    head = ("axis", "time s", "to", "a mm/s²", "J µm", "peak µm", "RMS µm", "contour µm")
    note = f"the newest {len(shown)} of {len(reversals)}" if len(shown) < len(reversals) else ""
    return ReportTable("Reversal by reversal", head, rows, note=note)
