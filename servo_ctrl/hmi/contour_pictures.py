"""What a Contour page shows of the last turns, made once for all pages that look at the same."""

from __future__ import annotations

import math
from collections import OrderedDict
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from servo_ctrl.hmi.capture_frames import Frame
from servo_ctrl.hmi.contour_view import (
    joined,
    magnified,
    polar_options,
    polar_points,
    quadrant_options,
    quadrant_points,
)
from servo_ctrl.hmi.contour_words import about, glitch_table
from servo_ctrl.telemetry.contour_traces import round_division

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from servo_ctrl.hmi.contour_watch import ContourWatch
    from servo_ctrl.hmi.units import Units

    Drawn: TypeAlias = "tuple[dict[str, Any], list[dict[str, Any]]]"

KEPT_PICTURES = 8
"""Some 60 kB each."""


class Look(NamedTuple):
    """How a page looks at the turns of a circle."""

    circle: tuple[int, int, int]
    factor: float
    """By which the error is magnified; 0: by the error."""
    fitted: bool
    """About the circle that is fitted to the table."""
    axes: tuple[str, ...]
    units: Units
    dark: bool


class Chart(NamedTuple):
    """Of one chart: its options and what it draws, and the points."""

    drawn: Drawn
    frame: Frame
    arrays: int


class TurnsPicture(NamedTuple):
    """All of it."""

    table: str
    about: str
    same: tuple[object, ...]
    """Charts of equal ones differ in their points alone."""
    polar: Chart
    quadrants: Chart


class Pictures:
    """The newest ones of a watch."""

    def __init__(self, watch: ContourWatch) -> None:
        self.made = 0
        self._watch = watch
        self._version = -1
        self._kept: OrderedDict[Look, TurnsPicture] = OrderedDict()

    def picture(self, look: Look) -> TurnsPicture | None:
        """As the turns are now; None: there is none of this circle."""
        if self._watch.version != self._version:
            self._version = self._watch.version
            self._kept.clear()
        found = self._kept.get(look)
        if found is None:
            found = self._made(look)
            if found is None:
                return None
            self._kept[look] = found
            self.made += 1
        self._kept.move_to_end(look)
        if len(self._kept) > KEPT_PICTURES:
            self._kept.popitem(last=False)
        return found

    def _made(self, look: Look) -> TurnsPicture | None:
        turns, units, dark = self._watch.turns(look.circle), look.units, look.dark
        if not turns:
            return None
        traces = [turn.fitted_trace if look.fitted else turn.trace for turn in turns]
        kinds, radius_m = [turn.kind for turn in turns], round(turns[0].circle.radius_m, 9)
        shown = magnified(traces, radius_m, look.factor)
        polar = [polar_points(trace, turn, shown.factor) for trace, turn in zip(traces, turns, strict=True)]
        quadrants = [quadrant_points(trace, place) for place in range(4) for trace in traces]
        shown_range = common_range(quadrants, units.error.factor)
        return TurnsPicture(
            glitch_table(turns, units),
            about(turns[-1], look.axes, shown, units),
            (tuple(kinds), radius_m, shown, shown_range, units.name, dark),
            _chart(polar_options(kinds, radius_m, shown, dark=dark), polar),
            _chart(quadrant_options(kinds, shown_range, units, dark=dark), quadrants),
        )


def common_range(parts: Sequence[NDArray[Any]], factor: float) -> tuple[float, float]:
    """Of errors (2, n) as they are shown, one for all panes: what is larger has to look larger."""
    errors = [part[1] * factor for part in parts if part.shape[1]]
    low = min((float(part.min()) for part in errors), default=0.0)
    high = max((float(part.max()) for part in errors), default=0.0)
    step = round_division(max(high, 0.0) - min(low, 0.0))
    return step * math.floor(min(low, 0.0) / step), step * max(math.ceil(high / step), 1)


def _chart(drawn: Drawn, parts: Sequence[NDArray[Any]]) -> Chart:
    payload, points = joined(parts)
    return Chart(drawn, Frame(0, 0, points, payload, reset=True), 2 * len(parts))
