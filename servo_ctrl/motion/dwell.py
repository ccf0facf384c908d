"""Standing still."""

from typing import NamedTuple

from kernels.arrays import Array
from servo_ctrl.motion.profile import Profile, resting


class Dwell(NamedTuple):
    """How long, seconds (> 0)."""

    label: str
    duration_s: float


def plan_dwell(dwell: Dwell, start_m: Array) -> Profile:
    """All axes rest at `start_m` (axes,)."""
    return Profile(dwell.duration_s, start_m, (0.0, 0.0), lambda time_s: resting(start_m, len(time_s)))
