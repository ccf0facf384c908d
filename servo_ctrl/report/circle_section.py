"""The section of circles: contour error by quadrant, and the terms of ISO 230-4:2022 that a recording yields.

The machine's own scales measure neither squareness nor bending nor thermal expansion outside them, so this is
no acceptance test by that standard. Over the last whole turn at constant speed:

    F_max, F_min   largest and smallest radial deviation from the commanded circle, outwards positive
    G              range of the deviation about the least-squares centre of the actual path
    H              largest radial difference of a clockwise and a counterclockwise run of one circle
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from servo_ctrl.learning.performance import circle_deviation, commanded_circle
from servo_ctrl.metrology.circles import last_turn
from servo_ctrl.plots.contour_traces import round_division
from servo_ctrl.recording.min_max import thinned
from servo_ctrl.report.axis_section import UM, in_um
from servo_ctrl.report.content import ReportPicture, ReportSection, ReportTable, Series
from servo_ctrl.report.header import RecordedStep
from servo_ctrl.report.recorded_run import RecordedAxis, RecordedRun

QUADRANTS = ("I", "II", "III", "IV")
STRETCHES = 720
"""Intervals of a drawn curve: one for each half degree."""
ALIKE_M = 1e-6
"""Circles whose centres and radii differ by less count as equal."""
ALIKE_SPEED = 0.01
"""Largest relative difference of feeds that count as equal."""
MOST_CIRCLES, MOST_DRAWN = 40, 6
"""Bounds the circles in the tables and in a plot to the newest."""
HYSTERESIS_ANGLES = 3600
"""Angles at which two runs are compared: one for each tenth of a degree."""


class CircleTurn(NamedTuple):
    """The last whole turn of a circle at constant speed; (n,) each."""

    label: str
    plane: tuple[str, str]
    radius_m: float
    centre_m: tuple[float, float]
    feed_m_s: float
    direction: int
    """+1 counterclockwise, -1 clockwise."""
    angle_rad: Array
    """Angle of the command, 0 to 2 pi."""
    deviation_m: Array
    """Radial deviation from the commanded circle, outwards positive."""
    circular_m: float
    """G."""


def circle_section(run: RecordedRun) -> ReportSection | None:
    """Return the section; None if no circle has a whole turn at constant speed."""
    circles = [(index, step, rows) for index, step, rows in run.steps() if step.kind == "circle"]
    newest = circles[-MOST_CIRCLES:]
    turns = [turn for index, step, rows in newest if (turn := _turn(run, index, step, rows)) is not None]
    if not turns:
        return None
    left_out = len(circles) - len(newest)
    text = (
        "Over the last whole turn at constant speed. The terms are those of ISO 230-4, from the machine's "
        "own scales: what these do not see is not in them, so this is not an acceptance test."
    )
    if left_out:
        text = f"The newest {len(newest)} of {len(circles)} circles. {text}"
    parts: list[ReportTable | ReportPicture] = [_terms(turns)]
    if hysteresis := _hysteresis_table(turns):
        parts.append(hysteresis)
    parts += [_quadrants(turns), *_polar(turns)]
    return ReportSection("Circles", (text,), tuple(parts))


def _turn(run: RecordedRun, index: int, step: RecordedStep, of_step: slice) -> CircleTurn | None:
    if len(run.axes) < 2:
        return None
    cycle = run.cycle[of_step]
    steady = (cycle >= step.steady_first_cycle) & (cycle <= step.steady_last_cycle)
    rows = of_step.start + np.flatnonzero(steady)
    axes = _plane(run.axes, rows)
    command_m = [axis.command_m[rows] for axis in axes]
    table_m = [axis.table_m[rows] for axis in axes]
    good = np.isfinite(np.sum(command_m, axis=0) + np.sum(table_m, axis=0))
    if np.count_nonzero(good) < 8:
        return None
    (x, y), table_m = ([one[good] for one in part_m] for part_m in (command_m, table_m))
    try:
        circle = commanded_circle(x, y)
        turn = last_turn("", circle, x, y, circle_deviation(circle, *table_m))
    except ValueError:
        return None
    angle_rad = turn.angle_rad
    whole = slice(-len(angle_rad), None)
    actual = [one[whole] for one in table_m]
    travel_m = float(np.ptp(angle_rad)) * circle.radius_m
    duration_s = float(np.ptp(run.cycle[rows][good][whole])) * run.header.period_s
    return CircleTurn(
        label=f"{index + 1} {step.label}",
        plane=(axes[0].name, axes[1].name),
        radius_m=circle.radius_m,
        centre_m=circle.centre_m,
        feed_m_s=travel_m / duration_s,
        direction=1 if angle_rad[-1] > angle_rad[0] else -1,
        angle_rad=np.mod(angle_rad, 2.0 * np.pi),
        deviation_m=turn.radial_error_m,
        circular_m=float(np.ptp(circle_deviation(commanded_circle(*actual), *actual))),
    )


def _plane(axes: tuple[RecordedAxis, ...], rows: NDArray[np.int64]) -> tuple[RecordedAxis, RecordedAxis]:
    """Return the two axes that move, in machine order."""
    travel = [float(np.ptp(axis.command_m[rows])) if len(rows) else 0.0 for axis in axes]
    first, second = sorted(sorted(range(len(axes)), key=lambda place: -np.nan_to_num(travel[place]))[:2])
    return axes[first], axes[second]


def _terms(turns: list[CircleTurn]) -> ReportTable:
    rows = [
        (
            turn.label,
            "".join(turn.plane).upper(),
            f"{turn.radius_m * 1e3:g}",
            f"{turn.feed_m_s * 60e3:.0f}",
            "ccw" if turn.direction > 0 else "cw",
            in_um(float(turn.deviation_m.max())),
            in_um(float(turn.deviation_m.min())),
            in_um(turn.circular_m),
        )
        for turn in turns
    ]
    head = ("circle", "plane", "R mm", "F mm/min", "way", "F_max µm", "F_min µm", "G µm")
    note = (
        "F: radial deviation from the commanded circle; G: circular deviation about the least-squares centre"
    )
    return ReportTable("Radial and circular deviation", head, tuple(rows), 2, note)


def _hysteresis_table(turns: list[CircleTurn]) -> ReportTable | None:
    rows = [
        (f"{turn.label} / {other.label}", in_um(hysteresis_m(turn, other)))
        for turn in turns
        for other in turns
        if turn.direction > 0 > other.direction and _alike(turn, other)
    ]
    head = ("two ways round one circle", "H µm")
    return ReportTable("Circular hysteresis", head, tuple(rows)) if rows else None


def hysteresis_m(one: CircleTurn, other: CircleTurn) -> float:
    """Return H, the largest difference of the two deviations at equal angles."""
    angle_rad: Array = np.linspace(0.0, 2.0 * np.pi, HYSTERESIS_ANGLES)
    first_m, second_m = (np.interp(angle_rad, *_sorted(turn), period=2.0 * np.pi) for turn in (one, other))
    return float(np.abs(first_m - second_m).max())


def _sorted(turn: CircleTurn) -> tuple[Array, Array]:
    order = np.argsort(turn.angle_rad)
    return turn.angle_rad[order], turn.deviation_m[order]


def _alike(one: CircleTurn, other: CircleTurn) -> bool:
    apart_m = np.subtract((one.radius_m, *one.centre_m), (other.radius_m, *other.centre_m))
    speeds = abs(one.feed_m_s - other.feed_m_s) <= ALIKE_SPEED * one.feed_m_s
    return one.plane == other.plane and speeds and float(np.abs(apart_m).max()) < ALIKE_M


def _quadrants(turns: list[CircleTurn]) -> ReportTable:
    rows = []
    for turn in turns:
        cells = []
        for number in range(4):
            inside = np.floor(turn.angle_rad / (np.pi / 2.0)) == number
            part_m = turn.deviation_m[inside]
            cells += [in_um(float(part_m.mean())), in_um(float(part_m.max())), in_um(float(part_m.min()))]
        rows.append((turn.label, *cells))
    head = ("circle", *(f"{name} {what} µm" for name in QUADRANTS for what in ("mean", "max", "min")))
    note = "quadrant I: both axes above the centre, then counterclockwise; outwards is positive"
    return ReportTable("Contour error by quadrant", head, tuple(rows), note=note)


def _polar(turns: list[CircleTurn]) -> list[ReportPicture]:
    """Return one plot for each plane and radius, with all feeds and both directions."""
    groups: dict[tuple[tuple[str, str], int], list[CircleTurn]] = {}
    for turn in turns:
        groups.setdefault((turn.plane, round(turn.radius_m / ALIKE_M)), []).append(turn)
    pictures: list[ReportPicture] = []
    for (plane, _), members in groups.items():
        drawn = members[-MOST_DRAWN:]
        division_um = round_division(max(float(np.abs(one.deviation_m).max()) for one in drawn) * UM, 1e-3)
        note = f"Magnified as a ballbar does: one ring is {division_um:g} µm, the bold one the command."
        if len(members) > MOST_DRAWN:
            note += f" The newest {MOST_DRAWN} of {len(members)}."
        pictures.append(
            ReportPicture(
                name=f"circle-{len(pictures) + 1}",
                heading=f"Contour error in {''.join(plane).upper()}, R = {drawn[0].radius_m * 1e3:g} mm",
                note=note,
                x_label=plane[0],
                y_label=plane[1],
                series=tuple(Series(one.label, *_closed(one)) for one in drawn),
                kind="polar",
                division=division_um,
            )
        )
    return pictures


def _closed(turn: CircleTurn) -> tuple[Array, Array]:
    angle_rad, deviation_m = _sorted(turn)
    angle_rad, deviation_m = thinned(angle_rad, deviation_m, STRETCHES)
    return np.append(angle_rad, angle_rad[0] + 2.0 * np.pi), np.append(deviation_m, deviation_m[0]) * UM
