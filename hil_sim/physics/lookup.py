"""Tables of evenly spaced values, for what has no law: linear between, held beyond."""

from typing import Any

from kernels.jit import kernel

POINTS = 33
"""Largest number of points of a table."""

LEAST_SPAN = 1e-12
"""Of a table's points: less is refused by its file's check, and must not end in a division by zero."""


@kernel
def share_of(place: float, first: float, last: float) -> float:
    """Where a place is on the way from the first point to the last, 0 to 1 between them."""
    return (place - first) / max(last - first, LEAST_SPAN)


@kernel
def interpolated(values: Any, points: float, share: float) -> float:
    """Value of the first `points` of `values` (at least two) at a share, 0 to 1, of the way along them."""
    last = int(points) - 1
    place = min(1.0, max(0.0, share)) * last
    first = min(int(place), last - 1)
    return float(values[first] + (values[first + 1] - values[first]) * (place - first))
