"""The sections of each axis: errors, force, and spectrum of the error."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from kernels.arrays import Array, true_runs
from servo_ctrl.recording.min_max import thinned
from servo_ctrl.report.content import LevelLine, ReportPicture, ReportSection, ReportTable, Series
from servo_ctrl.report.recorded_run import RecordedAxis, RecordedRun

UM = 1e6
STRETCHES = 600
"""Intervals of a series over time, each drawn by its minimum and maximum."""
SATURATED = 0.999
"""Share of the limit above which a force counts as saturated; allows for rounding in the file."""
MOST_STEPS = 15
"""Bounds the rows of the table of steps: half a sheet."""
NO_FORCE_N = 1e-9
"""Largest force command that counts as none: the axis rests, or its drive closes the loops."""


def axis_sections(run: RecordedRun) -> list[ReportSection]:
    """Return the tables of all axes, then the plots axis by axis."""
    sections = [ReportSection("Following and force", (_words(run),), (_following(run), _force(run)))]
    if steps := _by_step(run):
        sections.append(ReportSection("Step by step", (), (steps,)))
    return [*sections, *(_pictures(run, axis) for axis in run.axes)]


def _words(run: RecordedRun) -> str:
    text = (
        "Error: position command less table position, during the program. Following error: set point less "
        "what the position loop is closed on."
    )
    by_motor = ", ".join(axis.name for axis in run.axes if not axis.has_scale)
    return f"{text} Without a scale, the motor stands for the table: {by_motor}." if by_motor else text


def _following(run: RecordedRun) -> ReportTable:
    rows = []
    for axis in run.axes:
        error_m, following_m = axis.error_m[run.in_program], axis.following_m[run.in_program]
        limits = run.header.limits.get(axis.name)
        figures_m = (rms(error_m), largest(error_m), rms(following_m), largest(following_m))
        stops_at = in_um(limits.following_error_m) if limits else "not recorded"
        missing = int(np.count_nonzero(~np.isfinite(error_m)))
        rows.append((axis.name, *map(in_um, figures_m), stops_at, str(missing)))
    head = (
        *("axis", "error RMS µm", "error largest µm", "following RMS µm", "following largest µm"),
        *("stops at µm", "no value"),
    )
    note = "no value: rows without command or input"
    return ReportTable("How well the axes followed", head, tuple(rows), note=note)


def _force(run: RecordedRun) -> ReportTable:
    rows = []
    for axis in run.axes:
        force_n, limits = axis.force_n[run.in_program], run.header.limits.get(axis.name)
        current_a = axis.current_a[run.in_program]
        force = [f"{rms(force_n):.3g}", f"{largest(force_n):.3g}"]
        if largest(force_n) <= NO_FORCE_N:
            force = ["none commanded", "", "", "", ""]
        elif limits is None:
            force += ["not recorded", "", ""]
        else:
            at_limit = np.abs(force_n) >= SATURATED * limits.force_n
            longest_s = longest_run(at_limit) * run.header.period_s
            force += [f"{limits.force_n:.4g}", f"{100.0 * np.mean(at_limit):.2f}", f"{longest_s * 1e3:.0f}"]
        rows.append((axis.name, *force, f"{rms(current_a):.3g}", f"{largest(current_a):.3g}"))
    head = (
        *("axis", "force RMS N", "force largest N", "limit N", "at the limit %", "longest ms"),
        *("current RMS A", "current largest A"),
    )
    return ReportTable("Force and its saturation", head, tuple(rows))


def _by_step(run: RecordedRun) -> ReportTable | None:
    """Return the steps with the largest errors, in the order of the program."""
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
    head = ("step", "", "s", *(f"{axis.name}: {what} µm" for axis in run.axes for what in ("RMS", "largest")))
    return ReportTable("Errors of the steps that move", head, tuple(row for *_, row in shown), 2, note)


def _pictures(run: RecordedRun, axis: RecordedAxis) -> ReportSection:
    pictures = [
        _over_time(
            run, axis, "error", "error over time", y_label="command - table (µm)", values=axis.error_m * UM
        ),
        _over_time(
            run, axis, "position", "position over time", y_label="position (mm)", values=axis.command_m * 1e3
        ),
    ]
    limits, most_n = run.header.limits.get(axis.name), largest(axis.force_n)
    if most_n > NO_FORCE_N:
        force = _over_time(run, axis, "force", "force command", y_label="force (N)", values=axis.force_n)
        if limits is not None and most_n > 0.5 * limits.force_n:
            force = force._replace(levels=tuple(LevelLine("limit", s * limits.force_n) for s in (1.0, -1.0)))
        elif limits is not None:
            force = force._replace(note=f"limit {limits.force_n:.4g} N, beyond the picture")
        pictures.append(force)
    if (spectrum := spectral_density(axis.error_m, run.cycle, run.header.period_s)) is not None:
        pictures.append(
            ReportPicture(
                name=f"{axis.name}-spectrum",
                heading=f"Axis {axis.name}: spectrum of the error",
                note="Welch's method, Hann windows, over the longest stretch without a gap.",
                x_label="frequency (Hz)",
                y_label="µm / sqrt(Hz)",
                series=(Series("error", spectrum.frequency_hz, spectrum.density_m * UM),),
                kind="logarithmic",
            )
        )
    return ReportSection(f"Axis {axis.name}", (), tuple(pictures))


def _over_time(
    run: RecordedRun, axis: RecordedAxis, name: str, heading: str, y_label: str, values: Array
) -> ReportPicture:
    series = Series("command" if name == "position" else name, *thinned(run.time_s, values, STRETCHES))
    return ReportPicture(
        f"{axis.name}-{name}", f"Axis {axis.name}: {heading}", "time (s)", y_label, (series,)
    )


def rms(values: Array) -> float:
    """Return the root mean square of the finite values; NaN without any."""
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if len(finite) else float("nan")


def largest(values: Array) -> float:
    """Return the largest absolute value of the finite values; 0 without any."""
    return float(np.abs(values[np.isfinite(values)]).max(initial=0.0))


def longest_run(flags: NDArray[np.bool_]) -> int:
    """Return the length of the longest sequence of True."""
    return max((end - first for first, end in true_runs(flags)), default=0)


def in_um(value_m: float) -> str:
    """Format a length in micrometres; a dash if it is not finite."""
    return f"{value_m * UM:.2f}" if np.isfinite(value_m) else "-"


WINDOW = 2048
"""Samples of a window; adjacent windows overlap by half."""


class Spectrum(NamedTuple):
    """One-sided spectral density without the mean; (n,) each."""

    frequency_hz: Array
    density_m: Array
    """Metres per square root of a hertz; the integral of its square over frequency is the mean square."""


def spectral_density(error_m: Array, cycle: NDArray[np.int64], period_s: float) -> Spectrum | None:
    """Return the density over the longest part without a gap, by Welch's method (1967).

    None if it is constant or too short.
    """
    part = error_m[_whole(error_m, cycle)]
    if len(part) < 2 * WINDOW or not np.ptp(part):
        return None
    frequency_hz, density_m2_hz = welch(part, 1.0 / period_s, nperseg=WINDOW)
    return Spectrum(frequency_hz[1:-1], np.sqrt(density_m2_hz[1:-1]))


def _whole(error_m: Array, cycle: NDArray[np.int64]) -> slice:
    """Return the longest sequence of finite samples in consecutive cycles."""
    good = np.isfinite(error_m)
    follows = np.concatenate(([False], good[1:] & good[:-1] & (np.diff(cycle) == 1)))
    starts = np.flatnonzero(good & ~follows)
    ends = np.flatnonzero(good & ~np.append(follows[1:], False))
    if not len(starts):
        return slice(0, 0)
    longest = int(np.argmax(ends - starts))
    return slice(int(starts[longest]), int(ends[longest]) + 1)
