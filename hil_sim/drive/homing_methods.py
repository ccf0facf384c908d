"""The homing methods of CiA 402 as tables, and four manufacturer-specific ones by current.

Methods 3 to 14 home on the index pulse behind an edge of the home switch, 19 to 30 on the edge itself. Those
by current, for axes without switches, push against a mechanical stop: -1 and -2 return to the index pulse.
"""

from typing import NamedTuple

NO_HOMING = 0
"""Method 0: no homing required. A start moves nothing and reports whether the axis is homed."""
AT_PRESENT_POSITION = (35, 37)
"""Methods that take the present position as home."""
BY_CURRENT = {-1: (1, True), -2: (-1, True), -3: (1, False), -4: (-1, False)}
"""Direction to the mechanical stop, and whether the index pulse is home."""
WITH_INDEX = range(1, 15)
FIRST_WITHOUT_INDEX = 17


class HomeEdge(NamedTuple):
    """The direction in which an axis starts to search the home switch, and how it crosses the homing edge."""

    start: int
    direction: int
    leaves: bool
    """Whether the axis leaves the switch there: it opens."""


HOME = {
    3: HomeEdge(1, -1, True),
    4: HomeEdge(1, 1, False),
    5: HomeEdge(-1, 1, True),
    6: HomeEdge(-1, -1, False),
    7: HomeEdge(1, -1, True),
    8: HomeEdge(1, 1, False),
    9: HomeEdge(1, -1, False),
    10: HomeEdge(1, 1, True),
    11: HomeEdge(-1, 1, True),
    12: HomeEdge(-1, -1, False),
    13: HomeEdge(-1, 1, False),
    14: HomeEdge(-1, -1, True),
}
"""By method with index pulse; the method without has a number higher by 16."""
METHODS = (*WITH_INDEX, *range(FIRST_WITHOUT_INDEX, 31), 33, 34, *AT_PRESENT_POSITION, *BY_CURRENT)
"""In the order of 60E3h."""


def search_of(method: int) -> int:
    """Return the method with index pulse that makes the same moves."""
    return method - 16 if FIRST_WITHOUT_INDEX <= method <= 30 else method
