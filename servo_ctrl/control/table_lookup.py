"""Lookup in a learned table: its first row rises, the others are linear between its columns, level beyond."""

from kernels.jit import kernel
from kernels.records import Table

Place = tuple[int, int, float]
"""The columns below and above, and the share of the step between them."""


@kernel
def place_of(table: Table, at: float) -> Place:
    """Where `at` is in the first row of a table (rows, n), n >= 1; by bisection."""
    lower, upper = 0, table.shape[1] - 1
    while upper - lower > 1:
        middle = (lower + upper) // 2
        if table[0, middle] <= at:
            lower = middle
        else:
            upper = middle
    span = table[0, upper] - table[0, lower]
    share = min(max((at - table[0, lower]) / span, 0.0), 1.0) if span > 0.0 else 0.0
    return lower, upper, share


@kernel
def value_at(table: Table, row: int, place: Place) -> float:
    """The value of a row at a place."""
    lower, upper, share = place
    return float(table[row, lower] + share * (table[row, upper] - table[row, lower]))
