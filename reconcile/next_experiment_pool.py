"""The motions that an axis could be asked for, as steps of a program, each within its limits.

Each is a round of steps that is repeated until there is enough of it to be judged.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reconcile.next_experiment_rounds import DIGITS, Bounds, rounds
from servo_ctrl.motion.move import Move
from servo_ctrl.motion.program import segments
from servo_ctrl.motion.violation import first_violation

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from reconcile.next_experiment_limits import Limits
    from reconcile.next_experiment_rounds import Step

    Array = NDArray[np.float64]

RECORD_S, LONGEST_S = 18.0, 90.0
"""A round is repeated for so long; a motion that takes longer is not asked for."""
ROUNDED = 1.05
"""A limit that samples may seem to pass, by differences of what was planned within it."""


class Motion(NamedTuple):
    """One that may be asked for."""

    kind: str
    words: str
    """What it is, with its numbers."""
    steps: tuple[Step, ...]
    """Of the one axis, from its home to its home."""


class Planned(NamedTuple):
    """What servo_ctrl would command."""

    motion: Motion
    position_m: Array
    """(n,), a sample a period."""
    seconds: float


def pool(limits: Limits, period_s: float, slowest_m_s: float, finest_m: float) -> list[Planned]:
    """Every motion within the limits, planned as servo_ctrl does and refused where it would refuse.

    `slowest_m_s`, `finest_m`: a slower speed or a smaller stroke would be noise.
    """
    if limits.velocity_m_s <= slowest_m_s or limits.travel_m <= finest_m:
        return []  # all that it may do is noise
    found = []
    for kind, words, one_round in rounds(Bounds(limits, slowest_m_s, finest_m)):
        planned = _filled(Motion(kind, words, one_round), limits, period_s)
        if planned is not None:
            found.append(planned)
    return found


def plan(motion: Motion, limits: Limits, period_s: float) -> Planned | None:
    """The motion's samples from the axis' home; None where it leaves a limit."""
    start, allowed = np.array([limits.home_m]), limits.for_planning()
    parts = list(segments(motion.steps, start, allowed, period_s))
    bound = allowed._replace(
        velocity_m_s=ROUNDED * allowed.velocity_m_s,
        acceleration_m_s2=ROUNDED * allowed.acceleration_m_s2,
        jerk_m_s3=ROUNDED * allowed.jerk_m_s3,
    )
    if not parts or first_violation(iter(parts), start, bound, period_s) is not None:
        return None
    position_m = np.concatenate([start, *(part.position_m[:, 0] for part in parts)])
    return Planned(motion, position_m, len(position_m) * period_s)


def _filled(motion: Motion, limits: Limits, period_s: float) -> Planned | None:
    """Rounds of it, between a way there and a way home."""
    there = motion.steps[0]
    assert isinstance(there, Move)  # noqa: S101  # every round begins at a place
    once = plan(motion, limits, period_s)
    if once is None or once.seconds > LONGEST_S:
        return None
    times = max(round(RECORD_S / once.seconds), 1)
    home = there._replace(label="home", to_m=(round(limits.home_m, DIGITS),))
    return plan(motion._replace(steps=(*motion.steps * times, home)), limits, period_s)
