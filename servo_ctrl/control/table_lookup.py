"""Lookup in a learned table (rows, n): the first row rises; the others are interpolated linearly over it.

Beyond the first and the last column, their values are held.
"""

from kernels.jit import kernel
from kernels.record_layout import Table

Place = tuple[int, int, float]
"""Columns below and above a value, and its share of the distance between them."""


@kernel
def place_of(table: Table, value: float) -> Place:
    """Find `value` in the first row of a table (rows, n), n >= 1, by bisection."""
    lower, upper = 0, table.shape[1] - 1
    while upper - lower > 1:
        middle = (lower + upper) // 2
        if table[0, middle] <= value:
            lower = middle
        else:
            upper = middle
    span = table[0, upper] - table[0, lower]
    share = min(max((value - table[0, lower]) / span, 0.0), 1.0) if span > 0.0 else 0.0
    return lower, upper, share


@kernel
def value_at(table: Table, row: int, place: Place) -> float:
    """Interpolate a row at a place."""
    lower, upper, share = place
    return float(table[row, lower] + share * (table[row, upper] - table[row, lower]))
