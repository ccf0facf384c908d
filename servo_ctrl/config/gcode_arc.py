"""G2 and G3: circles through the start and the end, from the radius or from the centre as it was written.

What a file says of an arc is rounded, so that its start and its end are seldom on one circle exactly. The
centre is moved to where both have the same distance; an arc that needs more than rounding is refused.
"""

from __future__ import annotations

import math
from typing import NamedTuple

Point = tuple[float, float]

ROUNDING_M = 10e-6
"""By how much the radii at the start and at the end may differ: four decimals of an inch in start, centre
and end are up to 7 um."""
SHORTEST_M = 5e-6
"""An arc whose ends are no farther apart, and which is no circle, is a straight line."""
_SAME_M = 1e-9
"""Points that are no farther apart are one: what incremental coordinates leave."""
_MOVED_M = 1e-7
"""A centre that is moved by no more does not show."""


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


class Piece(NamedTuple):
    """An arc up to `end` about `centre`, or a straight line (None); `share` of the whole way done there."""

    end: Point
    centre: Point | None
    share: float


def by_radius(start: Point, end: Point, radius: float, *, counterclockwise: bool) -> list[Piece]:
    """An arc with R; a negative one takes the long way. Metres. Raises ArcError."""
    chord = math.dist(start, end)
    if chord < _SAME_M:
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
    centre = 0.5 * (start[0] + end[0]) + side * across[0], 0.5 * (start[1] + end[1]) + side * across[1]
    return [Piece(end, centre, 1.0)]


def by_centre(start: Point, end: Point, offset: Point, *, counterclockwise: bool) -> list[Piece]:
    """An arc whose centre is `offset` from its start (I and J). Metres. Raises ArcError."""
    centre = start[0] + offset[0], start[1] + offset[1]
    radius, at_end = math.dist(start, centre), math.dist(end, centre)
    if radius == 0.0:
        raise ArcError("the centre is the start: the radius is 0")
    if abs(at_end - radius) > ROUNDING_M:
        raise ArcError(
            f"the end is not on the circle: the radius is {radius * 1e3:.6g} mm at the start "
            f"and {at_end * 1e3:.6g} mm at the end"
        )
    if math.dist(start, end) < _SAME_M:
        return [Piece(start, centre, 1.0)]
    sweep = _sweep(start, end, centre, counterclockwise=counterclockwise)
    moved = _between(start, end, centre)
    if sweep <= math.pi:
        # the arc stays within the rounding of the written one, however far its centre moves
        return [Piece(end, centre=moved if math.dist(start, end) > SHORTEST_M else None, share=1.0)]
    if math.dist(moved, centre) <= _MOVED_M:
        return [Piece(end, moved, 1.0)]
    # a long arc would move with its centre: only its last quarter turn takes the rounding up
    turn = 0.5 * math.pi if counterclockwise else -0.5 * math.pi
    angle = math.atan2(end[1] - centre[1], end[0] - centre[0]) - turn
    middle = centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)
    first = Piece(middle, _between(start, middle, centre), 1.0 - 0.5 * math.pi / sweep)
    return [first, Piece(end, _between(middle, end, centre), 1.0)]


def _between(start: Point, end: Point, centre: Point) -> Point:
    """The centre moved along the chord to where start and end are equally far."""
    chord = math.dist(start, end)
    along = (end[0] - start[0]) / chord, (end[1] - start[1]) / chord
    middle = 0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1])
    shift = (middle[0] - centre[0]) * along[0] + (middle[1] - centre[1]) * along[1]
    return centre[0] + shift * along[0], centre[1] + shift * along[1]


def _sweep(start: Point, end: Point, centre: Point, *, counterclockwise: bool) -> float:
    """The angle from start to end in the arc's sense, 0 to a full turn."""
    first = math.atan2(start[1] - centre[1], start[0] - centre[0])
    last = math.atan2(end[1] - centre[1], end[0] - centre[0])
    return (last - first if counterclockwise else first - last) % (2.0 * math.pi)
