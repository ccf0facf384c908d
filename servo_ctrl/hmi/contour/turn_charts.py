"""The charts, table and text of the last turns, made once for all pages that display the same."""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from servo_ctrl.hmi.charts.echarts import Options, Trace
from servo_ctrl.hmi.charts.frames import ChartFrame
from servo_ctrl.hmi.contour.options import (
    Magnification,
    joined,
    magnification,
    polar_options,
    polar_points,
    quadrant_options,
    quadrant_points,
)
from servo_ctrl.hmi.contour.turn_store import TurnStore
from servo_ctrl.hmi.contour.turns import LABELS, LETTERS, QUADRANTS, CircleKey, MeasuredTurn, glitches_m
from servo_ctrl.hmi.languages.texts import ENGLISH, tr
from servo_ctrl.hmi.shell.plots import Look
from servo_ctrl.hmi.shell.units import UnitSystem, grouped
from servo_ctrl.plots.contour_traces import round_division

MAX_CACHED = 8
"""Bounds the memory of the cache, some 60 kB each."""


class TurnDisplay(NamedTuple):
    """What a page displays of the turns, and how."""

    circle: CircleKey
    factor: float
    """Magnification of the error; 0: chosen by the largest error."""
    fitted: bool
    """Error against the circle that is fitted to the actual positions."""
    axes: tuple[str, ...]
    look: Look
    language: str = ENGLISH
    """Of the texts: the charts are kept for all pages that display the same."""


class TurnChart(NamedTuple):
    """The options and traces of one chart, and the frame with its points."""

    options: Options
    traces: list[Trace]
    frame: ChartFrame
    arrays: int


class TurnCharts(NamedTuple):
    """Everything that is shown of the turns of a circle."""

    head: list[str]
    rows: list[list[str]]
    description: str
    drawn_for: tuple[object, ...]
    """While it is the same, the options of both charts are."""
    polar: TurnChart
    quadrants: TurnChart


@lru_cache(maxsize=MAX_CACHED)
def turn_charts(store: TurnStore, _version: int, display: TurnDisplay) -> TurnCharts | None:
    """Return the charts of the turns in a store of this version; None: there is no turn of this circle."""
    turns, look, units = store.turns(display.circle), display.look, display.look.units
    if not turns:
        return None
    traces = [turn.fitted_trace if display.fitted else turn.trace for turn in turns]
    kinds, radius_m = [turn.compensation for turn in turns], round(turns[0].circle.radius_m, 9)
    shown = magnification(traces, radius_m, display.factor)
    polar = [polar_points(trace, turn, shown.factor) for trace, turn in zip(traces, turns, strict=True)]
    quadrants = [quadrant_points(trace, number) for number in range(4) for trace in traces]
    error_range = common_range(quadrants, units.error.factor)
    return TurnCharts(
        head=[
            tr("Compensation"),
            *(f"{name} ({units.error.unit})" for name in (*QUADRANTS, tr("roundness"))),
        ],
        rows=glitch_rows(turns, units),
        description=describe_turn(turns[-1], display.axes, shown, units),
        drawn_for=(tuple(kinds), radius_m, shown, error_range, look),
        polar=_chart(polar_options(kinds, radius_m, shown, look.theme), polar),
        quadrants=_chart(quadrant_options(kinds, error_range, look), quadrants),
    )


def common_range(parts: Sequence[NDArray[Any]], factor: float) -> tuple[float, float]:
    """Round limits of the errors of all parts (2, n), as shown: the panes have one scale to be comparable."""
    errors = [part[1] * factor for part in parts if part.shape[1]]
    low = min((float(part.min()) for part in errors), default=0.0)
    high = max((float(part.max()) for part in errors), default=0.0)
    step = round_division(max(high, 0.0) - min(low, 0.0))
    return step * math.floor(min(low, 0.0) / step), step * max(math.ceil(high / step), 1)


def _chart(drawn: tuple[Options, list[Trace]], parts: Sequence[NDArray[Any]]) -> TurnChart:
    payload, points = joined(parts)
    return TurnChart(*drawn, ChartFrame(0, 0, points, payload, reset=True), 2 * len(parts))


@lru_cache(maxsize=128)  # every page asks for all of them after every turn
def circle_text(key: CircleKey, units: UnitSystem) -> str:
    """Return a circle in a list: radius, feed and direction."""
    radius_um, feed_mm_min, direction = key
    arrow = "\N{ANTICLOCKWISE OPEN CIRCLE ARROW}" if direction > 0 else "\N{CLOCKWISE OPEN CIRCLE ARROW}"
    radius, feed = units.length.with_unit(radius_um * 1e-6), units.feed.with_unit(feed_mm_min / 60e3)
    return f"R {radius}, {feed} {arrow}"


def describe_turn(turn: MeasuredTurn, axes: tuple[str, ...], shown: Magnification, units: UnitSystem) -> str:
    """Return the commanded circle, how far the actual one is off it, and how the error is drawn."""
    length, error, circle, fitted = units.length, units.error, turn.circle, turn.fitted
    x_m, y_m = (
        actual - commanded for actual, commanded in zip(fitted.centre_m, circle.centre_m, strict=True)
    )
    return tr(
        "Circle about {first} {first_at}, {second} {second_at}; R {radius}, {feed}, {direction}. "
        "The table's own circle ({compensation}): centre off by {first_off}, {second_off}, radius by "
        "{radius_off}. Error drawn {factor} times; one division is {division}.",
        first=axes[0],
        first_at=length.text(circle.centre_m[0]),
        second=axes[1],
        second_at=length.with_unit(circle.centre_m[1]),
        radius=length.with_unit(circle.radius_m),
        feed=units.feed.with_unit(turn.feed_m_s),
        direction=tr("counterclockwise") if turn.direction > 0 else tr("clockwise"),
        compensation=tr(LABELS[turn.compensation]),
        first_off=error.text(x_m, sign=True),
        second_off=error.with_unit(y_m, sign=True),
        radius_off=error.with_unit(fitted.radius_m - circle.radius_m, sign=True),
        factor=grouped(shown.factor),
        division=error.with_unit(shown.division_m),
    )


def glitch_rows(turns: Sequence[MeasuredTurn], units: UnitSystem) -> list[list[str]]:
    """Return the four glitches of each turn, and the roundness about its least-squares circle."""
    error = units.error
    rows = []
    for turn in turns:
        heights = (error.text(height, sign=True) for height in glitches_m(turn.trace))
        roundness_m = float(np.ptp(turn.fitted_trace.radial_error_m))
        name = f"{tr(LABELS[turn.compensation])}\n{LETTERS.get(turn.compensation, '')}"
        rows.append([name, *heights, error.text(roundness_m)])
    return rows
