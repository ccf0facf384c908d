"""The charts, table and text of the last turns, made once for all pages that display the same."""

import math
from collections import OrderedDict
from collections.abc import Sequence
from typing import Any, NamedTuple

from numpy.typing import NDArray

from servo_ctrl.hmi.charts.echarts import Options, Trace
from servo_ctrl.hmi.charts.frames import ChartFrame
from servo_ctrl.hmi.contour.options import (
    joined,
    magnification,
    polar_options,
    polar_points,
    quadrant_options,
    quadrant_points,
)
from servo_ctrl.hmi.contour.texts import describe_turn, glitch_head, glitch_rows
from servo_ctrl.hmi.contour.turn_store import TurnStore
from servo_ctrl.hmi.contour.turns import CircleKey
from servo_ctrl.hmi.shell.units import UnitSystem
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
    units: UnitSystem
    dark: bool


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
    look: tuple[object, ...]
    """While it is the same, the options of both charts are."""
    polar: TurnChart
    quadrants: TurnChart


class TurnChartCache:
    """The newest charts of a store."""

    def __init__(self, store: TurnStore) -> None:
        self.made = 0
        self._store = store
        self._version = -1
        self._charts: OrderedDict[TurnDisplay, TurnCharts] = OrderedDict()

    def charts(self, display: TurnDisplay) -> TurnCharts | None:
        """The charts of the present turns; None: there is no turn of this circle."""
        if self._store.version != self._version:
            self._version = self._store.version
            self._charts.clear()
        charts = self._charts.get(display)
        if charts is None:
            charts = self._make(display)
            if charts is None:
                return None
            self._charts[display] = charts
            self.made += 1
        self._charts.move_to_end(display)
        if len(self._charts) > MAX_CACHED:
            self._charts.popitem(last=False)
        return charts

    def _make(self, display: TurnDisplay) -> TurnCharts | None:
        turns, units, dark = self._store.turns(display.circle), display.units, display.dark
        if not turns:
            return None
        traces = [turn.fitted_trace if display.fitted else turn.trace for turn in turns]
        kinds, radius_m = [turn.compensation for turn in turns], round(turns[0].circle.radius_m, 9)
        shown = magnification(traces, radius_m, display.factor)
        polar = [polar_points(trace, turn, shown.factor) for trace, turn in zip(traces, turns, strict=True)]
        quadrants = [quadrant_points(trace, number) for number in range(4) for trace in traces]
        error_range = common_range(quadrants, units.error.factor)
        return TurnCharts(
            head=glitch_head(units),
            rows=glitch_rows(turns, units),
            description=describe_turn(turns[-1], display.axes, shown, units),
            look=(tuple(kinds), radius_m, shown, error_range, units.name, dark),
            polar=_chart(polar_options(kinds, radius_m, shown, dark=dark), polar),
            quadrants=_chart(quadrant_options(kinds, error_range, units, dark=dark), quadrants),
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
