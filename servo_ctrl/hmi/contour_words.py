"""Circles and their glitches in words and figures."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from servo_ctrl.hmi.contour_turns import LABELS, QUADRANTS, glitches_m
from servo_ctrl.hmi.figures_table import figures_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from servo_ctrl.hmi.contour_turns import Turn
    from servo_ctrl.hmi.contour_view import Magnified
    from servo_ctrl.hmi.units import Units


@lru_cache(maxsize=128)  # every page asks for all of them at every turn
def circle_text(key: tuple[int, int, int], units: Units) -> str:
    """A circle to be picked from a list."""
    radius_um, feed_mm_min, sense = key
    arrow = "\N{ANTICLOCKWISE OPEN CIRCLE ARROW}" if sense > 0 else "\N{CLOCKWISE OPEN CIRCLE ARROW}"
    radius, feed = units.length.with_unit(radius_um * 1e-6), units.feed.with_unit(feed_mm_min / 60e3)
    return f"R {radius}, {feed} {arrow}"


def about(turn: Turn, axes: tuple[str, ...], shown: Magnified, units: Units) -> str:
    """Which circle, how far the table's own one is off it, and how the error is drawn."""
    length, error, circle = units.length, units.error, turn.circle
    off_m = [seen - wanted for seen, wanted in zip(turn.fitted.centre_m, circle.centre_m, strict=True)]
    wider_m = turn.fitted.radius_m - circle.radius_m
    times = f"{shown.factor:,.0f}".replace(",", "\N{THIN SPACE}")
    return (
        f"Circle about {axes[0]} {length.text(circle.centre_m[0])}, "
        f"{axes[1]} {length.with_unit(circle.centre_m[1])}; "
        f"R {length.with_unit(circle.radius_m)}, {units.feed.with_unit(turn.feed_m_s)}, "
        f"{'counterclockwise' if turn.sense > 0 else 'clockwise'}. "
        f"The table's own circle ({LABELS[turn.kind]}): centre off by {error.text(off_m[0], sign=True)}, "
        f"{error.with_unit(off_m[1], sign=True)}, radius by {error.with_unit(wider_m, sign=True)}. "
        f"Error drawn {times} times; one division is {error.with_unit(shown.division_m)}."
    )


def glitch_table(turns: Sequence[Turn], units: Units) -> str:
    """A line for each compensation; the last column is about the least-squares circle."""
    error = units.error
    head = ["Compensation", *(f"{name} ({error.unit})" for name in QUADRANTS), f"roundness ({error.unit})"]
    lines = []
    for turn in turns:
        heights = [error.text(height, sign=True) for height in glitches_m(turn.trace)]
        lines.append(
            [LABELS[turn.kind], *heights, error.text(float(np.ptp(turn.fitted_trace.radial_error_m)))]
        )
    return figures_table(head, lines)
