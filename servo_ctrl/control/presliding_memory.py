"""Which part of presliding slips: the nonlocal memory of the commanded motion.

Presliding is springs in parallel, each of which slips beyond its own displacement b. On a branch behind a
reversal at full sliding a spring slips from the travel 2 b on; on the first branch, from rest, from b on
(Masing 1926). A motion that returns to where a loop has opened goes on as if the loop had not been (Madelung
1905; Al-Bender, Lampaert and Swevers 2005, nonlocal memory). From rest, the first loop closes where the
motion is as far on the other side.

Slipping are hence the springs with 2 b below one travel, `slip_travel_m`. It is the travel since the reversal
unless the motion before it was short. Five reversals are remembered. With a sixth the innermost loop, the
smallest one, counts as closed.
"""

import math
from typing import NamedTuple

from kernels.jit import kernel

FORGOTTEN_M = math.inf
"""Position of what is not there, or not any more: infinitely far, where all slips."""


class Branch(NamedTuple):
    """Positions of the command at which open loops have turned, m, or `FORGOTTEN_M`."""

    rest_m: float
    """Where the first motion began, with relaxed springs."""
    turn_1_m: float
    """The last reversal."""
    turn_2_m: float
    turn_3_m: float
    turn_4_m: float
    turn_5_m: float


@kernel
def relaxed_at(position_m: float) -> Branch:
    """All springs relaxed."""
    return Branch(position_m, FORGOTTEN_M, FORGOTTEN_M, FORGOTTEN_M, FORGOTTEN_M, FORGOTTEN_M)


@kernel
def moved_by(branch: Branch, shift_m: float) -> Branch:
    """The same memory in coordinates in which all positions are by `shift_m` larger."""
    return Branch(
        branch.rest_m + shift_m,
        branch.turn_1_m + shift_m,
        branch.turn_2_m + shift_m,
        branch.turn_3_m + shift_m,
        branch.turn_4_m + shift_m,
        branch.turn_5_m + shift_m,
    )


@kernel
def turned(branch: Branch, turn_m: float) -> Branch:
    """Remember a reversal; with a sixth the innermost loop is forgotten."""
    rest_m, first_m, second_m, third_m, fourth_m, fifth_m = branch
    if math.isinf(fifth_m):
        return Branch(rest_m, turn_m, first_m, second_m, third_m, fourth_m)
    return Branch(rest_m, turn_m, third_m, fourth_m, fifth_m, FORGOTTEN_M)


@kernel
def without_closed_loop(branch: Branch, position_m: float, direction: float) -> Branch:
    """Forget the last loop where a motion in `direction` (+1 or -1) has closed it."""
    rest_m, first_m, second_m, third_m, fourth_m, fifth_m = branch
    opened_m = 2.0 * rest_m - first_m if math.isinf(second_m) else second_m
    if not math.isfinite(opened_m) or direction * (position_m - opened_m) < 0.0:
        return branch
    return Branch(rest_m, third_m, fourth_m, fifth_m, FORGOTTEN_M, FORGOTTEN_M)


@kernel
def slip_travel_m(branch: Branch, position_m: float, direction: float) -> float:
    """Travel behind a reversal at full sliding, m, with as much slip."""
    if not math.isinf(branch.turn_1_m):
        return direction * (position_m - branch.turn_1_m)
    return 2.0 * direction * (position_m - branch.rest_m)
