"""The section of repeated bidirectional approaches to targets: the figures of ISO 230-2.

A reading is the mean error over the last 50 ms of a rest. Because it uses the machine's own scale, this is no
acceptance test by that standard.
"""

from typing import NamedTuple

import numpy as np

from kernels.arrays import Array, true_runs
from servo_ctrl.learning.performance import REST_M
from servo_ctrl.metrology.iso_230_2 import Positioning, positioning
from servo_ctrl.report.axis_section import UM, in_um
from servo_ctrl.report.content import ReportPicture, ReportSection, ReportTable, Series
from servo_ctrl.report.recorded_run import RecordedAxis, RecordedRun

READ_S = 0.05
SHORTEST_REST_S = 0.2
SAME_M = 1e-7
"""Targets that differ by less count as equal."""
FEWEST_TARGETS = 2
FEWEST_RUNS = 2


class Visits(NamedTuple):
    """The readings of one axis."""

    target_m: Array
    """Targets in rising order, (targets,)."""
    deviation_m: Array
    """Table minus target, (runs, targets, 2); the last index is 0 from below, 1 from above."""


def positioning_section(run: RecordedRun) -> ReportSection | None:
    """Return the section; None if no axis approached targets from both sides at least twice."""
    found = [(axis, visits) for axis in run.axes if (visits := visits_of(run, axis)) is not None]
    if not found:
        return None
    figures = [(axis, visits, positioning(visits.deviation_m)) for axis, visits in found]
    text = (
        f"Readings after rests of {SHORTEST_REST_S:g} s at least. The terms are those of ISO 230-2, from the "
        "machine's own scale: what this does not see is not in them, so this is not an acceptance test."
    )
    parts: list[ReportTable | ReportPicture] = [_terms(figures)]
    parts += [_picture(axis, visits, result) for axis, visits, result in figures]
    return ReportSection("Positioning", (text,), tuple(parts))


def visits_of(run: RecordedRun, axis: RecordedAxis) -> Visits | None:
    """Return the readings of the targets with enough on both sides; the number of runs is that of all."""
    by_target: dict[int, tuple[list[float], list[float]]] = {}
    for target_m, side, deviation_m in _readings(run, axis):
        by_target.setdefault(round(target_m / SAME_M), ([], []))[side].append(deviation_m)
    enough = {
        key: sides for key, sides in by_target.items() if min(len(sides[0]), len(sides[1])) >= FEWEST_RUNS
    }
    if len(enough) < FEWEST_TARGETS:
        return None
    targets = sorted(enough)
    runs = min(len(side) for key in targets for side in enough[key])
    readings_m = np.array([[enough[key][side][:runs] for side in (0, 1)] for key in targets])
    return Visits(np.array(targets) * SAME_M, np.moveaxis(readings_m, 2, 0))


def _readings(run: RecordedRun, axis: RecordedAxis) -> list[tuple[float, int, float]]:
    """Return target, side (0 from below, 1 from above) and deviation of each rest of the program."""
    command_m = np.where(run.in_program, axis.command_m, np.nan)
    step_m = np.diff(command_m, prepend=np.nan)
    step_m[np.diff(run.cycle, prepend=run.cycle[0]) != 1] = np.nan
    rest = np.abs(step_m) < REST_M
    found = []
    for first, end in true_runs(rest):
        approach_m = step_m[first - 1] if first else np.nan
        if end - first < SHORTEST_REST_S / run.header.period_s or not np.isfinite(approach_m):
            continue
        reading_m = -axis.error_m[end - max(round(READ_S / run.header.period_s), 1) : end]
        if np.isfinite(reading_m).all():
            found.append((float(command_m[end - 1]), int(approach_m < 0.0), float(reading_m.mean())))
    return found


def _terms(figures: list[tuple[RecordedAxis, Visits, Positioning]]) -> ReportTable:
    rows = []
    for axis, visits, found in figures:
        runs, targets, _ = visits.deviation_m.shape
        values_m = (
            *(found.accuracy_m, found.up.accuracy_m, found.down.accuracy_m),
            *(found.repeatability_m, found.up.repeatability_m, found.down.repeatability_m),
            *(found.systematic_m, found.mean_bidirectional_m, found.reversal_m),
        )
        rows.append((axis.name, str(targets), str(runs), *map(in_um, values_m)))
    head = (
        *("axis", "targets", "runs", "A µm", "A up", "A down", "R µm", "R up", "R down"),
        *("E µm", "M µm", "B µm"),
    )
    note = (
        "A: accuracy, R: repeatability, E: systematic deviation, M: mean bidirectional deviation, "
        "B: reversal error; the standard requires five runs"
    )
    return ReportTable("Accuracy and repeatability", head, tuple(rows), note=note)


def _picture(axis: RecordedAxis, visits: Visits, found: Positioning) -> ReportPicture:
    series = [
        Series(name, visits.target_m * 1e3, found.mean_m[:, side] * UM, 2.0 * found.estimator_m[:, side] * UM)
        for side, name in enumerate(("from below", "from above"))
    ]
    return ReportPicture(
        name=f"{axis.name}-positioning",
        heading=f"Axis {axis.name}: deviation at the targets",
        note="Mean of the runs; the bars reach two estimators s to either side.",
        x_label="target (mm)",
        y_label="deviation (µm)",
        series=tuple(series),
    )
