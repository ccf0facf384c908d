"""Which part of presliding slips: the nonlocal memory of the commanded motion.

Presliding is springs in parallel, each of which slips beyond its own displacement b. On a branch behind a
reversal at full sliding a spring slips from the travel 2 b on; on the first branch, from rest, from b on
(Masing 1926). A motion that returns to where a loop has opened goes on as if the loop had not been (Madelung
1905; Al-Bender, Lampaert and Swevers 2005, nonlocal memory). From rest, the first loop closes where the
motion is as far on the other side.

Slipping are hence the springs with 2 b below one travel, `slip_travel_m`. It is the travel since the reversal
unless the motion before it was short. Five reversals are remembered, each with the force that is held from
there on. With a sixth the innermost loop, the smallest one, counts as closed.
"""

import math
from typing import NamedTuple

from kernels.jit import kernel

FORGOTTEN_M = math.inf
"""Position of what is not there, or not any more: infinitely far, where all slips."""


class Turn(NamedTuple):
    """A reversal that has opened a loop."""

    position_m: float
    """Of the command, or `FORGOTTEN_M`."""
    held_n: float
    """Force that is held until the loop has closed; its law is the caller's."""


NO_TURN = Turn(FORGOTTEN_M, 0.0)


class Branch(NamedTuple):
    """Open loops."""

    rest_m: float
    """Where the first motion began, with relaxed springs."""
    turn_1: Turn
    """The last reversal."""
    turn_2: Turn
    turn_3: Turn
    turn_4: Turn
    turn_5: Turn


@kernel
def relaxed_at(position_m: float) -> Branch:
    """All springs relaxed."""
    return Branch(position_m, NO_TURN, NO_TURN, NO_TURN, NO_TURN, NO_TURN)


@kernel
def shifted(turn: Turn, shift_m: float) -> Turn:
    """The same reversal in coordinates in which all positions are by `shift_m` larger."""
    return Turn(turn.position_m + shift_m, turn.held_n)


@kernel
def moved_by(branch: Branch, shift_m: float) -> Branch:
    """The same memory in coordinates in which all positions are by `shift_m` larger."""
    return Branch(
        branch.rest_m + shift_m,
        shifted(branch.turn_1, shift_m),
        shifted(branch.turn_2, shift_m),
        shifted(branch.turn_3, shift_m),
        shifted(branch.turn_4, shift_m),
        shifted(branch.turn_5, shift_m),
    )


@kernel
def turned(branch: Branch, turn: Turn) -> Branch:
    """Remember a reversal; with a sixth the innermost loop is forgotten."""
    rest_m, first, second, third, fourth, fifth = branch
    if math.isinf(fifth.position_m):
        return Branch(rest_m, turn, first, second, third, fourth)
    return Branch(rest_m, turn, third, fourth, fifth, NO_TURN)


@kernel
def without_closed_loop(branch: Branch, position_m: float, direction: float) -> Branch:
    """Forget the last loop where a motion in `direction` (+1 or -1) has closed it."""
    rest_m, first, second, third, fourth, fifth = branch
    from_rest = math.isinf(second.position_m)
    opened_m = 2.0 * rest_m - first.position_m if from_rest else second.position_m
    if not math.isfinite(opened_m) or direction * (position_m - opened_m) < 0.0:
        return branch
    return Branch(rest_m, third, fourth, fifth, NO_TURN, NO_TURN)


@kernel
def slip_travel_m(branch: Branch, position_m: float, direction: float) -> float:
    """Travel behind a reversal at full sliding, m, with as much slip."""
    if not math.isinf(branch.turn_1.position_m):
        return direction * (position_m - branch.turn_1.position_m)
    return 2.0 * direction * (position_m - branch.rest_m)
