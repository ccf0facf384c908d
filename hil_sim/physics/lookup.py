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


@kernel
def bilinear(values: Any, columns: float, rows: float, along: float, across: float) -> float:
    """Interpolate a grid of `rows` times `columns` values bilinearly, at relative positions 0 to 1.

    `values` has row by row, at least two of each; `along` is the position within a row, `across` that from
    the first row to the last. Outside 0 to 1 it returns the value at the nearest edge.
    """
    last_column, last_row = int(columns) - 1, int(rows) - 1
    column = min(1.0, max(0.0, along)) * last_column
    row = min(1.0, max(0.0, across)) * last_row
    left, lower = min(int(column), last_column - 1), min(int(row), last_row - 1)
    first = lower * (last_column + 1) + left
    second = first + last_column + 1
    share = column - left
    below = values[first] + (values[first + 1] - values[first]) * share
    above = values[second] + (values[second + 1] - values[second]) * share
    return float(below + (above - below) * (row - lower))
