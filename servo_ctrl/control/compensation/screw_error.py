"""Screw error: what the table's position differs from the motor's, learned over the travel.

    x_motor = x* - e(x*),   e = scale - motor at the table position x, mean of both directions

ISO 230-2 calls 2 e's spread over the travel the mean bidirectional positional deviation; Wang et al. 2014 the
accumulated pitch error. Linear between the nodes, level beyond them.

At take-over, and where another table comes into use, e is another one at the same position. That difference
is handed to the backlash take-up, whose motion leads it in: the motor does not jump.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from servo_ctrl.control.jit import kernel

if TYPE_CHECKING:
    from servo_ctrl.control.params import ScrewError


@kernel
def screw_error_m(p: ScrewError, position_m: float) -> float:
    """E (m) at a table position (m); 0 when disabled."""
    if not p.enabled:
        return 0.0
    last = p.table.shape[1] - 1
    lower, upper = 0, last
    while upper - lower > 1:
        middle = (lower + upper) // 2
        if p.table[0, middle] <= position_m:
            lower = middle
        else:
            upper = middle
    span_m = p.table[0, upper] - p.table[0, lower]
    share = min(max((position_m - p.table[0, lower]) / span_m, 0.0), 1.0) if span_m > 0.0 else 0.0
    return float(p.table[1, lower] + share * (p.table[1, upper] - p.table[1, lower]))
