"""Each axis: its errors, its force, and the spectrum of the error."""

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from servo_ctrl.recording.min_max import thinned
from servo_ctrl.report.content import LevelLine, ReportPicture, ReportSection, ReportTable, Series
from servo_ctrl.report.recorded_run import RecordedAxis, RecordedRun
from servo_ctrl.report.spectrum import spectral_density

UM = 1e6
STRETCHES = 600
"""Stretches of a series over time, each drawn by its least and its largest value."""
SATURATED = 0.999
"""Share of the limit from which on a force counts as saturated; below it by the rounding of the columns."""
MOST_STEPS = 15
"""Bounds the table of steps: half a sheet."""
NO_FORCE_N = 1e-9
"""Largest force command that counts as none: the axis rested, or its drive closes the loops."""


def axis_sections(run: RecordedRun) -> list[ReportSection]:
    """Tables of all axes, then the pictures axis by axis."""
    sections = [ReportSection("Following and force", (_words(run),), (_following(run), _force(run)))]
    if steps := _by_step(run):
        sections.append(ReportSection("Step by step", (), (steps,)))
    return [*sections, *(_pictures(run, axis) for axis in run.axes)]


def _words(run: RecordedRun) -> str:
    by_motor = [axis.name for axis in run.axes if not axis.has_scale]
    text = (
        "Error: position command less table position, during the program. Following error: set point less "
        "what the position loop is closed on."
    )
    return text + (
        f" Without a scale, the motor stands for the table: {', '.join(by_motor)}." if by_motor else ""
    )


def _following(run: RecordedRun) -> ReportTable:
    rows = []
    for axis in run.axes:
        error_m, following_m = axis.error_m[run.in_program], axis.following_m[run.in_program]
        limits = run.header.limits.get(axis.name)
        rows.append(
            (
                axis.name,
                *(in_um(one) for one in (rms(error_m), largest(error_m))),
                *(in_um(one) for one in (rms(following_m), largest(following_m))),
                in_um(limits.following_error_m) if limits else "not recorded",
                str(int(np.count_nonzero(~np.isfinite(error_m)))),
            )
        )
    head = (
        *("axis", "error RMS um", "error largest um", "following RMS um", "following largest um"),
        *("stops at um", "no value"),
    )
    return ReportTable(
        "How well the axes followed", head, tuple(rows), note="no value: rows without command or input"
    )


def _force(run: RecordedRun) -> ReportTable:
    rows = []
    for axis in run.axes:
        force_n, limits = axis.force_n[run.in_program], run.header.limits.get(axis.name)
        current = axis.current_a[run.in_program]
        if largest(force_n) <= NO_FORCE_N:
            force = ("none commanded", "", "", "", "")
        elif limits is None:
            force = (f"{rms(force_n):.3g}", f"{largest(force_n):.3g}", "not recorded", "", "")
        else:
            at_limit = np.abs(force_n) >= SATURATED * limits.force_n
            longest_s = longest_run(at_limit) * run.header.period_s
            force = (
                f"{rms(force_n):.3g}",
                f"{largest(force_n):.3g}",
                f"{limits.force_n:.4g}",
                f"{100.0 * np.mean(at_limit):.2f}",
                f"{longest_s * 1e3:.0f}",
            )
        rows.append((axis.name, *force, f"{rms(current):.3g}", f"{largest(current):.3g}"))
    head = (
        *("axis", "force RMS N", "force largest N", "limit N", "at the limit %", "longest ms"),
        *("current RMS A", "current largest A"),
    )
    return ReportTable("Force and its saturation", head, tuple(rows))


def _by_step(run: RecordedRun) -> ReportTable | None:
    """The steps with the largest errors, in the order of the program."""
    found = []
    for index, step, rows in run.steps():
        errors = [axis.error_m[rows] for axis in run.axes]
        if all(np.ptp(axis.command_m[rows]) == 0.0 for axis in run.axes):
            continue  # the axes rest
        cells = [in_um(one) for error_m in errors for one in (rms(error_m), largest(error_m))]
        duration_s = (rows.stop - rows.start) * run.header.period_s
        worst_m = max((largest(error_m) for error_m in errors), default=0.0)
        found.append((worst_m, index, (str(index + 1), step.label, f"{duration_s:.2f}", *cells)))
    if not found:
        return None
    shown = sorted(sorted(found, reverse=True)[:MOST_STEPS], key=lambda one: one[1])
    note = f"the {len(shown)} of {len(found)} with the largest errors" if len(shown) < len(found) else ""
    head = ("step", "", "s", *(f"{axis.name}: {what} um" for axis in run.axes for what in ("RMS", "largest")))
    return ReportTable("Errors of the steps that move", head, tuple(row for *_, row in shown), 2, note)


def _pictures(run: RecordedRun, axis: RecordedAxis) -> ReportSection:
    time_s = run.time_s
    pictures = [
        ReportPicture(
            name=f"{axis.name}-error",
            heading=f"Axis {axis.name}: error over time",
            note="",
            x_label="time (s)",
            y_label="command - table (um)",
            series=(Series("error", *thinned(time_s, axis.error_m * UM, STRETCHES)),),
        ),
        ReportPicture(
            name=f"{axis.name}-position",
            heading=f"Axis {axis.name}: position over time",
            note="",
            x_label="time (s)",
            y_label="position (mm)",
            series=(Series("command", *thinned(time_s, axis.command_m * 1e3, STRETCHES)),),
        ),
    ]
    limits = run.header.limits.get(axis.name)
    if largest(axis.force_n) > NO_FORCE_N:
        levels = (
            ()
            if limits is None
            else (LevelLine("limit", limits.force_n), LevelLine("limit", -limits.force_n))
        )
        near = limits is not None and largest(axis.force_n) > 0.5 * limits.force_n
        note = "" if limits is None or near else f"limit {limits.force_n:.4g} N, beyond the picture"
        pictures.append(
            ReportPicture(
                name=f"{axis.name}-force",
                heading=f"Axis {axis.name}: force command",
                note=note,
                x_label="time (s)",
                y_label="force (N)",
                series=(Series("force", *thinned(time_s, axis.force_n, STRETCHES)),),
                levels=levels if near else (),
            )
        )
    if (spectrum := spectral_density(axis.error_m, run.cycle, run.header.period_s)) is not None:
        pictures.append(
            ReportPicture(
                name=f"{axis.name}-spectrum",
                heading=f"Axis {axis.name}: spectrum of the error",
                note="Welch's method, Hann windows, over the longest stretch without a gap.",
                x_label="frequency (Hz)",
                y_label="um / sqrt(Hz)",
                series=(Series("error", spectrum.frequency_hz, spectrum.density_m * UM),),
                kind="logarithmic",
            )
        )
    return ReportSection(f"Axis {axis.name}", (), tuple(pictures))


def rms(values: Array) -> float:
    """Root mean square of the finite values; NaN without any."""
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if len(finite) else float("nan")


def largest(values: Array) -> float:
    """Largest absolute value of the finite values; 0 without any."""
    return float(np.abs(values[np.isfinite(values)]).max(initial=0.0))


def longest_run(flags: NDArray[np.bool_]) -> int:
    """Length of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def in_um(value_m: float) -> str:
    """Micrometres; a dash for a value that is not finite."""
    return f"{value_m * UM:.2f}" if np.isfinite(value_m) else "-"
