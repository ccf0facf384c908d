"""Circles and their glitches as texts and table rows."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from servo_ctrl.hmi.contour.options import Magnification
from servo_ctrl.hmi.contour.turns import LABELS, QUADRANTS, CircleKey, MeasuredTurn, glitches_m
from servo_ctrl.hmi.shell.units import UnitSystem, grouped


@lru_cache(maxsize=128)  # every page asks for all of them after every turn
def circle_text(key: CircleKey, units: UnitSystem) -> str:
    """A circle in a list: radius, feed and direction."""
    radius_um, feed_mm_min, direction = key
    arrow = "\N{ANTICLOCKWISE OPEN CIRCLE ARROW}" if direction > 0 else "\N{CLOCKWISE OPEN CIRCLE ARROW}"
    radius, feed = units.length.with_unit(radius_um * 1e-6), units.feed.with_unit(feed_mm_min / 60e3)
    return f"R {radius}, {feed} {arrow}"


def describe_turn(turn: MeasuredTurn, axes: tuple[str, ...], shown: Magnification, units: UnitSystem) -> str:
    """The commanded circle, how far the actual one is off it, and how the error is drawn."""
    length, error, circle, fitted = units.length, units.error, turn.circle, turn.fitted
    x_m, y_m = (
        actual - commanded for actual, commanded in zip(fitted.centre_m, circle.centre_m, strict=True)
    )
    return (
        f"Circle about {axes[0]} {length.text(circle.centre_m[0])}, "
        f"{axes[1]} {length.with_unit(circle.centre_m[1])}; "
        f"R {length.with_unit(circle.radius_m)}, {units.feed.with_unit(turn.feed_m_s)}, "
        f"{'counterclockwise' if turn.direction > 0 else 'clockwise'}. "
        f"The table's own circle ({LABELS[turn.compensation]}): centre off by {error.text(x_m, sign=True)}, "
        f"{error.with_unit(y_m, sign=True)}, "
        f"radius by {error.with_unit(fitted.radius_m - circle.radius_m, sign=True)}. "
        f"Error drawn {grouped(shown.factor)} times; one division is {error.with_unit(shown.division_m)}."
    )


def glitch_head(units: UnitSystem) -> list[str]:
    """The head of the table of glitches."""
    unit = units.error.unit
    return ["Compensation", *(f"{name} ({unit})" for name in QUADRANTS), f"roundness ({unit})"]


def glitch_rows(turns: Sequence[MeasuredTurn], units: UnitSystem) -> list[list[str]]:
    """The four glitches of each turn, and the roundness about its least-squares circle."""
    error = units.error
    rows = []
    for turn in turns:
        heights = (error.text(height, sign=True) for height in glitches_m(turn.trace))
        roundness_m = float(np.ptp(turn.fitted_trace.radial_error_m))
        rows.append([LABELS[turn.compensation], *heights, error.text(roundness_m)])
    return rows
