"""Tables of evenly spaced values, for effects without a law: linear between points, constant beyond."""

from typing import Any

from kernels.jit import kernel

POINTS_MAX = 33
"""Bounds the number of points of a table, which is the length of its record; chosen."""

SPAN_MIN = 1e-12
"""Bounds the span of a table from below, in its own unit: prevents a division by zero. Chosen."""


@kernel
def relative_position(value: float, first: float, last: float) -> float:
    """Return the position of `value` relative to the first point (0) and the last (1) of a table."""
    return (value - first) / max(last - first, SPAN_MIN)


@kernel
def interpolated(values: Any, points: float, relative: float) -> float:
    """Interpolate the first `points` of `values` (at least two) linearly at a relative position, 0 to 1.

    Outside 0 to 1 it returns the first or the last value.
    """
    last = int(points) - 1
    knot = min(1.0, max(0.0, relative)) * last
    left = min(int(knot), last - 1)
    return float(values[left] + (values[left + 1] - values[left]) * (knot - left))
