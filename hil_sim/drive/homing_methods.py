"""The homing methods of CiA 402 as tables, and four by current.

Methods 3 to 14 take an edge of the home switch and the index pulse behind it, 19 to 30 the edge alone. Those
by current, for axes without switches, push against a block: -1 and -2 go back to the index pulse.
"""

from typing import NamedTuple

NO_HOMING = 0
"""Method 0: no homing is required, so a start searches nothing and shows whether the axis is homed."""
AT_PRESENT_POSITION = (35, 37)
"""Methods that take the present position as home."""
BY_CURRENT = {-1: (1, True), -2: (-1, True), -3: (1, False), -4: (-1, False)}
"""Direction to the block, and whether the index pulse is home."""
WITH_INDEX = range(1, 15)
FIRST_WITHOUT_INDEX = 17


class HomeEdge(NamedTuple):
    """Which way an axis goes to look for the home switch, and how it crosses the edge that counts."""

    start: int
    direction: int
    leaves: bool
    """Whether the switch opens there."""


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
"""By method with index; that without is 16 more."""
METHODS = (*WITH_INDEX, *range(FIRST_WITHOUT_INDEX, 31), 33, 34, *AT_PRESENT_POSITION, *BY_CURRENT)
"""In the order of 60E3h."""


def search_of(method: int) -> int:
    """The method with index that makes the same moves."""
    return method - 16 if FIRST_WITHOUT_INDEX <= method <= 30 else method
