"""The path of a program as a picture that a browser draws once: SVG lines, coloured by speed, to scale.

Texts and the mark of the axes' place are laid over it by their share of the width and height, so that they
keep their size on a narrow screen, and moving the mark costs next to nothing.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from servo_ctrl.hmi.palette import GRID_DARK, GRID_LIGHT

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from servo_ctrl.hmi.units import Scale

    Array = NDArray[np.float64]

MARGIN = 0.07
"""Free on each side, of the larger extent."""
FLATTEST = 0.45
"""Height of the picture over its width, at least; and the other way round."""
LEAST_SPAN_M = 1e-6
TICKS = 5
_VIRIDIS = ("#440154", "#482878", "#3e4989", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b")
ON_LIGHT, ON_DARK = _VIRIDIS[:8], _VIRIDIS[3:]
"""From slow to fast: the ends that could not be seen on their ground are left out."""


class Tick(NamedTuple):
    """A line of the grid: its text, and where it is, per cent from the left or the top."""

    text: str
    share: float


class PathPicture(NamedTuple):
    """A picture of that part of the plane."""

    svg: str
    left_m: float
    top_m: float
    width_m: float
    height_m: float
    across: tuple[Tick, ...]
    up: tuple[Tick, ...]

    def share_of(self, across_m: float, up_m: float) -> tuple[float, float] | None:
        """Where a place is, per cent from left and top; None outside of the picture."""
        left = 100.0 * (across_m - self.left_m) / self.width_m
        top = 100.0 * (self.top_m - up_m) / self.height_m
        return (left, top) if 0.0 <= left <= 100.0 and 0.0 <= top <= 100.0 else None


def picture_of(path_m: Array, speed_m_s: Array, scale: Scale, *, dark: bool) -> PathPicture:
    """Draw positions (n, 2) with their speeds (n,); the grid has round values of the scale."""
    lowest_m, highest_m = path_m.min(axis=0), path_m.max(axis=0)
    middle_m = 0.5 * (lowest_m + highest_m)
    span_m = np.maximum(highest_m - lowest_m, LEAST_SPAN_M)
    span_m = span_m + 2.0 * MARGIN * span_m.max()
    span_m = np.maximum(span_m, FLATTEST * span_m[::-1])
    left_m, top_m = middle_m[0] - 0.5 * span_m[0], middle_m[1] + 0.5 * span_m[1]
    ticks = [
        _ticks(middle_m[axis] - 0.5 * span_m[axis], middle_m[axis] + 0.5 * span_m[axis], scale)
        for axis in (0, 1)
    ]
    across = tuple(Tick(text, 100.0 * (at_m - left_m) / span_m[0]) for text, at_m in ticks[0])
    up = tuple(Tick(text, 100.0 * (top_m - at_m) / span_m[1]) for text, at_m in ticks[1])
    # user units: thousandths of the larger span, so that numbers stay short
    unit_m = span_m.max() / 1000.0
    x, y = (path_m[:, 0] - left_m) / unit_m, (top_m - path_m[:, 1]) / unit_m
    width, height = span_m / unit_m
    grid = GRID_DARK if dark else GRID_LIGHT
    lines = [f"M{share * width / 100.0:.1f} 0V{height:.1f}" for _, share in across]
    lines += [f"M0 {share * height / 100.0:.1f}H{width:.1f}" for _, share in up]
    body = f'<path d="{"".join(lines)}" stroke="{grid}" stroke-width="1"/>'
    body += "".join(
        f'<path d="{d}" stroke="{colour}" stroke-width="2.5"/>'
        for colour, d in _pieces(x, y, speed_m_s, ON_DARK if dark else ON_LIGHT)
    )
    svg = (
        f'<svg viewBox="0 0 {width:.1f} {height:.1f}" fill="none" stroke-linecap="round" '
        f'stroke-linejoin="round" class="bench-path-lines">{body}</svg>'
    )
    return PathPicture(svg, float(left_m), float(top_m), float(span_m[0]), float(span_m[1]), across, up)


def _pieces(x: Array, y: Array, speed_m_s: Array, colours: tuple[str, ...]) -> list[tuple[str, str]]:
    """Stretches of one colour each, one behind the other; neighbours share their point."""
    if len(x) < 2:
        return [(colours[0], f"M{x[0]:.1f} {y[0]:.1f}h0")]
    top = max(float(speed_m_s.max()), 1e-12)
    between = 0.5 * (speed_m_s[1:] + speed_m_s[:-1]) / top
    bins = np.minimum((between * len(colours)).astype(int), len(colours) - 1)
    starts = np.concatenate(([0], np.flatnonzero(np.diff(bins)) + 1, [len(bins)]))
    points = [f"{across:.1f} {down:.1f}" for across, down in zip(x, y, strict=True)]
    return [
        (colours[bins[first]], "M" + "L".join(points[first : end + 1])) for first, end in pairwise(starts)
    ]


def _ticks(lowest_m: float, highest_m: float, scale: Scale) -> list[tuple[str, float]]:
    """Round values of the scale within the bounds, as text and in metres."""
    lowest, highest = lowest_m * scale.factor, highest_m * scale.factor
    step = round_step((highest - lowest) / TICKS)
    first, last = math.ceil(lowest / step), math.floor(highest / step)
    return [
        (f"{n * step:.6g}".replace("-", "\N{MINUS SIGN}"), n * step / scale.factor)
        for n in range(first, last + 1)
    ]


def round_step(least: float) -> float:
    """The smallest of 1, 2, 5 times a power of ten that is no smaller."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= least * (1.0 - 1e-9))
