"""The path of a program as SVG lines, to scale and coloured by speed.

Texts and the ring at the axes' position are laid over it by their percentage of width and height: they keep
their size on a narrow screen, and moving the ring costs the browser next to nothing.
"""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.hmi.shell.plots import Theme
from servo_ctrl.hmi.shell.units import MINUS, DisplayUnit

MARGIN = 0.07
"""Free space on each side, as a share of the larger extent; chosen."""
MIN_ASPECT_RATIO = 0.45
"""Bounds the ratio of height to width, and of width to height, from below; chosen: a straight path needs
an area."""
MIN_SPAN_M = 1e-6
"""Bounds the extent of a path from below, metres; chosen, for a path of a single point."""
GRID_LINES = 5
"""Approximate number of grid lines in each direction; chosen."""


class Tick(NamedTuple):
    """A grid line: its text, and its place in per cent from the left or the top."""

    text: str
    percent: float


class PathPicture(NamedTuple):
    """The picture, and the part of the plane that it shows."""

    svg: str
    left_m: float
    top_m: float
    width_m: float
    height_m: float
    horizontal: tuple[Tick, ...]
    vertical: tuple[Tick, ...]

    def place_of(self, x_m: float, y_m: float) -> tuple[float, float] | None:
        """Return a position in per cent from left and top; None outside of the picture."""
        left = 100.0 * (x_m - self.left_m) / self.width_m
        top = 100.0 * (self.top_m - y_m) / self.height_m
        return (left, top) if 0.0 <= left <= 100.0 and 0.0 <= top <= 100.0 else None


def path_picture(path_m: Array, speed_m_s: Array, unit: DisplayUnit, theme: Theme) -> PathPicture:
    """Draw positions (n, 2) with their speeds (n,); the grid lines have round values of the unit."""
    lowest_m, highest_m = path_m.min(axis=0), path_m.max(axis=0)
    centre_m = 0.5 * (lowest_m + highest_m)
    span_m = np.maximum(highest_m - lowest_m, MIN_SPAN_M)
    span_m = span_m + 2.0 * MARGIN * span_m.max()
    span_m = np.maximum(span_m, MIN_ASPECT_RATIO * span_m[::-1])
    left_m, top_m = centre_m[0] - 0.5 * span_m[0], centre_m[1] + 0.5 * span_m[1]
    x_ticks, y_ticks = (
        _ticks(centre - 0.5 * span, centre + 0.5 * span, unit)
        for centre, span in zip(centre_m, span_m, strict=True)
    )
    horizontal = tuple(Tick(text, 100.0 * (at_m - left_m) / span_m[0]) for text, at_m in x_ticks)
    vertical = tuple(Tick(text, 100.0 * (top_m - at_m) / span_m[1]) for text, at_m in y_ticks)
    # SVG units are thousandths of the larger span, which keeps the numbers short
    svg_unit_m = span_m.max() / 1000.0
    x, y = (path_m[:, 0] - left_m) / svg_unit_m, (top_m - path_m[:, 1]) / svg_unit_m
    width, height = span_m / svg_unit_m
    grid = [f"M{tick.percent * width / 100.0:.1f} 0V{height:.1f}" for tick in horizontal]
    grid += [f"M0 {tick.percent * height / 100.0:.1f}H{width:.1f}" for tick in vertical]
    body = f'<path d="{"".join(grid)}" stroke="{theme.grid}" stroke-width="1"/>'
    body += "".join(
        f'<path d="{d}" stroke="{colour}" stroke-width="2.5"/>'
        for colour, d in _coloured_stretches(x, y, speed_m_s, theme.speeds)
    )
    svg = (
        f'<svg viewBox="0 0 {width:.1f} {height:.1f}" fill="none" stroke-linecap="round" '
        f'stroke-linejoin="round" class="bench-path-lines">{body}</svg>'
    )
    place_m = float(left_m), float(top_m), float(span_m[0]), float(span_m[1])
    return PathPicture(svg, *place_m, horizontal, vertical)


def _coloured_stretches(
    x: Array, y: Array, speed_m_s: Array, colours: tuple[str, ...]
) -> list[tuple[str, str]]:
    """Return colour and SVG path of each stretch of one colour; neighbours share their common point."""
    if len(x) < 2:
        return [(colours[0], f"M{x[0]:.1f} {y[0]:.1f}h0")]
    top = max(float(speed_m_s.max()), 1e-12)
    mean = 0.5 * (speed_m_s[1:] + speed_m_s[:-1]) / top
    bins = np.minimum((mean * len(colours)).astype(int), len(colours) - 1)
    starts = np.concatenate(([0], np.flatnonzero(np.diff(bins)) + 1, [len(bins)]))
    points = [f"{left:.1f} {down:.1f}" for left, down in zip(x, y, strict=True)]
    return [
        (colours[bins[first]], "M" + "L".join(points[first : end + 1])) for first, end in pairwise(starts)
    ]


def _ticks(lowest_m: float, highest_m: float, unit: DisplayUnit) -> list[tuple[str, float]]:
    """Return round values of the unit between the bounds, as text and in metres."""
    lowest, highest = lowest_m * unit.factor, highest_m * unit.factor
    step = round_step((highest - lowest) / GRID_LINES)
    first, last = math.ceil(lowest / step), math.floor(highest / step)
    return [(f"{n * step:.6g}".replace("-", MINUS), n * step / unit.factor) for n in range(first, last + 1)]


def round_step(least: float) -> float:
    """Return the smallest of 1, 2, 5 times a power of ten that is not below `least`, but for rounding."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= least * (1.0 - 1e-9))
