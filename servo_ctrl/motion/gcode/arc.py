"""Computes the centre of G2 and G3 arcs from R, or from I, J and K.

Because the numbers in a file are rounded, start and end of an arc seldom have the same distance to the
centre. A difference of rounding is accepted (`motion/path/path_move.py` lets the radius drift), a larger one
is refused.
"""

import math
from typing import NamedTuple

Point = tuple[float, float]

ROUNDING_M = 10e-6
"""Bounds the difference of the radii at start and end: four decimals of an inch in start, centre and end
give up to 7 um."""
SAME_M = 1e-9
"""Points closer than this, metres, coincide: incremental coordinates leave rounding errors; chosen."""


class ArcError(ValueError):
    """An impossible arc; the message gives the reason, in millimetres."""


class Plane(NamedTuple):
    """The axes of a plane in the order that makes G3 counterclockwise, and the letters of the centre."""

    axes: tuple[str, str]
    centre: tuple[str, str]


PLANES = {
    "G17": Plane(("x", "y"), ("I", "J")),
    "G18": Plane(("z", "x"), ("K", "I")),
    "G19": Plane(("y", "z"), ("J", "K")),
}


def centre_by_radius(start: Point, end: Point, radius: float, *, counterclockwise: bool) -> Point:
    """Return the centre of an arc with R, metres; R < 0 selects the arc over 180 degrees. Raises ArcError."""
    chord = math.dist(start, end)
    if chord < SAME_M:
        raise ArcError("an arc with R must end elsewhere than it starts; write a full circle with its centre")
    half = 0.5 * chord
    if radius == 0.0 or half - abs(radius) > ROUNDING_M:
        raise ArcError(
            f"R {radius * 1e3:.6g} mm is too small: start and end are {chord * 1e3:.6g} mm apart, "
            f"which takes {half * 1e3:.6g} mm at least"
        )
    # a counterclockwise arc below 180 degrees has its centre to the left of the chord from start to end
    height = math.sqrt(max((abs(radius) - half) * (abs(radius) + half), 0.0))
    side = height if counterclockwise == (radius > 0.0) else -height
    across = -(end[1] - start[1]) / chord, (end[0] - start[0]) / chord
    return 0.5 * (start[0] + end[0]) + side * across[0], 0.5 * (start[1] + end[1]) + side * across[1]


def centre_by_offset(start: Point, end: Point, offset: Point) -> Point:
    """Return the centre at `offset` (I, J) from the start. Raises ArcError if the end is off the circle."""
    centre = start[0] + offset[0], start[1] + offset[1]
    at_start, at_end = math.dist(start, centre), math.dist(end, centre)
    if at_start == 0.0:
        raise ArcError("the centre is the start: the radius is 0")
    if abs(at_end - at_start) > ROUNDING_M:
        raise ArcError(
            f"the end is not on the circle: the radius is {at_start * 1e3:.6g} mm at the start "
            f"and {at_end * 1e3:.6g} mm at the end"
        )
    return centre
