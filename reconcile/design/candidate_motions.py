"""Plans the candidate motions of an axis within its limits, as servo_ctrl would run them.

Each repeats one excitation until the recording is long enough for a diagnosis.
"""

from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.design.excitations import DIGITS, Excitation, ExcitationBounds, excitations
from reconcile.design.limits import AxisLimits
from servo_ctrl.motion.move import Move
from servo_ctrl.motion.program import segments
from servo_ctrl.motion.violation import first_violation

RECORDING_S, MAX_EXCITATION_S = 18.0, 90.0
"""Time for which an excitation is repeated, about; an excitation longer than the second is not proposed."""
DIFFERENCE_MARGIN = 1.05
"""Largest factor by which differences of samples may exceed a limit that the planned motion keeps."""


class PlannedMotion(NamedTuple):
    """A motion as commanded by servo_ctrl."""

    motion: Excitation
    position_m: Array
    """(n,), one sample per period."""
    seconds: float


def candidate_motions(
    limits: AxisLimits, period_s: float, min_velocity_m_s: float, min_stroke_m: float
) -> list[PlannedMotion]:
    """Return every motion that servo_ctrl would accept within the limits.

    Below `min_velocity_m_s` and `min_stroke_m` a motion would be noise.
    """
    if limits.velocity_m_s <= min_velocity_m_s or limits.travel_m <= min_stroke_m:
        return []
    bounds = ExcitationBounds(limits, min_velocity_m_s, min_stroke_m)
    planned = (_repeated(one, limits, period_s) for one in excitations(bounds))
    return [one for one in planned if one is not None]


def plan_motion(motion: Excitation, limits: AxisLimits, period_s: float) -> PlannedMotion | None:
    """Return the samples of a motion from the home position; None if it leaves a limit."""
    start, allowed = np.array([limits.home_m]), limits.for_planning()
    parts = list(segments(motion.steps, start, allowed, period_s))
    bound = allowed._replace(
        velocity_m_s=DIFFERENCE_MARGIN * allowed.velocity_m_s,
        acceleration_m_s2=DIFFERENCE_MARGIN * allowed.acceleration_m_s2,
        jerk_m_s3=DIFFERENCE_MARGIN * allowed.jerk_m_s3,
    )
    if not parts or first_violation(iter(parts), start, bound, period_s) is not None:
        return None
    position_m = np.concatenate([start, *(part.position_m[:, 0] for part in parts)])
    return PlannedMotion(motion, position_m, len(position_m) * period_s)


def _repeated(motion: Excitation, limits: AxisLimits, period_s: float) -> PlannedMotion | None:
    """Plan a motion that repeats its steps and returns home."""
    there = motion.steps[0]
    assert isinstance(there, Move)  # noqa: S101  # every excitation begins with a move
    once = plan_motion(motion, limits, period_s)
    if once is None or once.seconds > MAX_EXCITATION_S:
        return None
    times = max(round(RECORDING_S / once.seconds), 1)
    home = there._replace(label="home", to_m=(round(limits.home_m, DIGITS),))
    return plan_motion(motion._replace(steps=(*motion.steps * times, home)), limits, period_s)
