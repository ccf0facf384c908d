"""Tables of evenly spaced values, for effects without a law: linear between points, constant beyond."""

from typing import Any

from kernels.jit import kernel

POINTS = 33
"""Largest number of points of a table."""

LEAST_SPAN = 1e-12
"""Least span of a table's points, which prevents a division by zero; the file check refuses less."""


@kernel
def share_of(place: float, first: float, last: float) -> float:
    """Return the relative position of `place` between the first point (0) and the last (1)."""
    return (place - first) / max(last - first, LEAST_SPAN)


@kernel
def interpolated(values: Any, points: float, share: float) -> float:
    """Interpolate the first `points` of `values` (at least two) at the relative position `share`, 0 to 1."""
    last = int(points) - 1
    place = min(1.0, max(0.0, share)) * last
    first = min(int(place), last - 1)
    return float(values[first] + (values[first + 1] - values[first]) * (place - first))
