"""G2 and G3: where the centre is, from the radius or from the centre as it was written.

What a file says of an arc is rounded, so that its start and its end are seldom equally far from the centre.
That much is taken as it is written (`motion/path/path_move.py` lets the radius drift); more is refused.
"""

import math
from typing import NamedTuple

Point = tuple[float, float]

ROUNDING_M = 10e-6
"""By how much the radii at the start and at the end may differ: four decimals of an inch in start, centre
and end are up to 7 um."""
SAME_M = 1e-9
"""Points within this are one, metres: incremental coordinates leave rounding errors; chosen."""


class ArcError(ValueError):
    """An arc that cannot be; the message says why, in millimetres."""


class Plane(NamedTuple):
    """The axes of G17, G18 and G19 in the order that makes G3 counterclockwise, and the centre's letters."""

    axes: tuple[str, str]
    centre: tuple[str, str]


PLANES = {
    "G17": Plane(("x", "y"), ("I", "J")),
    "G18": Plane(("z", "x"), ("K", "I")),
    "G19": Plane(("y", "z"), ("J", "K")),
}


def centre_by_radius(start: Point, end: Point, radius: float, *, counterclockwise: bool) -> Point:
    """The centre of an arc with R; a negative one takes the long way. Metres. Raises ArcError."""
    chord = math.dist(start, end)
    if chord < SAME_M:
        raise ArcError("an arc with R must end elsewhere than it starts; write a full circle with its centre")
    half = 0.5 * chord
    if radius == 0.0 or half - abs(radius) > ROUNDING_M:
        raise ArcError(
            f"R {radius * 1e3:.6g} mm is too small: start and end are {chord * 1e3:.6g} mm apart, "
            f"which takes {half * 1e3:.6g} mm at least"
        )
    # a short counterclockwise arc has its centre to the left of the way from start to end
    height = math.sqrt(max((abs(radius) - half) * (abs(radius) + half), 0.0))
    side = height if counterclockwise == (radius > 0.0) else -height
    across = -(end[1] - start[1]) / chord, (end[0] - start[0]) / chord
    return 0.5 * (start[0] + end[0]) + side * across[0], 0.5 * (start[1] + end[1]) + side * across[1]


def centre_by_offset(start: Point, end: Point, offset: Point) -> Point:
    """The centre that is `offset` from the start (I and J), if the end is on the circle. Raises ArcError."""
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
