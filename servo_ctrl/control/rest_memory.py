"""Force that a rest adds to friction, over how long the command stood and the travel behind that.

An axis that has stood breaks away with more friction than one that turns, and loses the difference over some
travel (Dieterich 1979; Ruina 1983). How much over which time and travel is learned (`learning.rest_force`);
no law of it is here. A row of a table holds the duration of a rest, s, rising by rows; N forces for a start
in the direction of the last motion; and N for one against it, as presliding is wound up in the first case
only. The forces stand at the travels `SPAN_M` (k / N)^3, k = 1 to N, equally spaced in time at constant jerk;
at travel 0 the force is 0.

What acts relaxes to the force of the table over the travel `FOLLOW_M`. So it never jumps: not where a motion
turns again before the force has gone, nor where it stops there and goes on later.
"""

import math
from typing import NamedTuple

from kernels.jit import kernel
from kernels.record_layout import Table

SPAN_M = 1e-3
"""Travel behind a rest over which a force is learned. Chosen: ten times the longest plausible contact."""
FOLLOW_M = 0.1e-6
"""Travel to relax over. Chosen: the resolution of a scale; 0.5 um were as good on development tables."""
NEGLIGIBLE_N = 1e-9
"""Force below which nothing is left of one."""
STILL_M = 1e-12
"""Step of the command up to which it stands. Chosen: far below any scale, above rounding."""


class Rest(NamedTuple):
    """The last rest of the command, as it is foreseen by the dead time."""

    still_s: float
    """How long the command has stood until now; 0 in motion."""
    stood_s: float
    """How long it stood before the last motion began."""
    turned: bool
    """Whether that began against the motion before."""
    travel_m: float
    """Travel since it began, `SPAN_M` at most."""
    force_n: float
    """The force that acts, along the axis."""


@kernel
def without_rest() -> Rest:
    """No rest yet, and no force: the rest begins to count."""
    return Rest(0.0, 0.0, False, SPAN_M, 0.0)


@kernel
def _in_row(rests: Table, row: int, turned: bool, place: float) -> float:
    nodes = (rests.shape[1] - 1) // 2
    column = int(place)
    if column >= nodes:
        return 0.0
    first = 1 + (nodes if turned else 0)
    before_n = rests[row, first + column - 1] if column > 0 else 0.0
    return float(before_n + (place - column) * (rests[row, first + column] - before_n))


@kernel
def rest_force_n(rests: Table, stood_s: float, turned: bool, travel_m: float) -> float:
    """Force in the direction of motion, N, `travel_m` >= 0 behind a rest of `stood_s`; 0 beyond `SPAN_M`.

    Interpolated over the logarithm of the rest, held above the longest, fading to 0 below the shortest.
    """
    if not travel_m < SPAN_M or not rests[0, 0] > 0.0:
        return 0.0
    place = math.pow(travel_m / SPAN_M, 1.0 / 3.0) * ((rests.shape[1] - 1) // 2)
    last = rests.shape[0] - 1
    within_s = min(max(stood_s, rests[0, 0]), rests[last, 0])
    lower = 0
    while lower < last - 1 and rests[lower + 1, 0] <= within_s:
        lower += 1
    force_n = _in_row(rests, lower, turned, place)
    if lower < last:
        share = math.log(within_s / rests[lower, 0]) / math.log(rests[lower + 1, 0] / rests[lower, 0])
        force_n += share * (_in_row(rests, lower + 1, turned, place) - force_n)
    return float(min(stood_s / rests[0, 0], 1.0) * force_n)


@kernel
def rest_after(rests: Table, rest: Rest, step_m: float, direction: float, period_s: float) -> Rest:
    """The rest after a step of the command; `direction`: of the motion before, 0 if there was none.

    A stop that is shorter than the shortest learned rest, and than the rest before, counts only where the
    travel behind that has been passed: a stop for some cycles does not undo what a minute has done.
    """
    if abs(step_m) <= STILL_M:
        return Rest(rest.still_s + period_s, rest.stood_s, rest.turned, rest.travel_m, rest.force_n)
    stood_s, turned, travel_m, force_n = rest.stood_s, rest.turned, rest.travel_m, rest.force_n
    if rest.still_s > 0.0 and (travel_m >= SPAN_M or rest.still_s >= min(stood_s, rests[0, 0])):
        stood_s, turned, travel_m = rest.still_s, step_m * direction < 0.0, 0.0
    travel_m = min(travel_m + abs(step_m), SPAN_M)
    if travel_m < SPAN_M or abs(force_n) > NEGLIGIBLE_N:
        table_n = math.copysign(1.0, step_m) * rest_force_n(rests, stood_s, turned, travel_m)
        force_n = table_n + (force_n - table_n) * math.exp(-abs(step_m) / FOLLOW_M)
    else:
        force_n = 0.0
    return Rest(0.0, stood_s, turned, travel_m, force_n)
