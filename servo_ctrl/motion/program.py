"""Plans the steps of a program one after the other and samples them, in segments, at the SYNC period.

Sample i of a step (i = 1, 2, ...) is its profile at t = i T; the last sample is clamped to the end, so that
the end position is exact for any duration. Each step starts at the end of the previous one.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.motion.circle import Circle, plan_circle
from servo_ctrl.motion.move import Dwell, Move, plan_move
from servo_ctrl.motion.path.path_move import PathMove, plan_path
from servo_ctrl.motion.profile import MotionLimits, Profile, standstill
from servo_ctrl.motion.samples import Samples, plan_samples
from servo_ctrl.motion.sine import Sine, plan_sine
from servo_ctrl.motion.trapezoidal import ThereAndBack, plan_there_and_back

Step = Move | Circle | Sine | ThereAndBack | Dwell | Samples | PathMove

KIND_OF_STEP: dict[type, str] = {
    Move: "move",
    Circle: "circle",
    Sine: "sine",
    ThereAndBack: "s_shape",
    Dwell: "dwell",
    Samples: "samples",
    PathMove: "path",
}
"""The name of each kind of step in a program file."""

SEGMENT_SAMPLES = 65_536
"""Bounds the samples of a segment, and so memory; longer steps have several segments; chosen."""

_GRID_TOLERANCE = 1e-9
"""Rounding error allowed in a number of periods; chosen."""


class Segment(NamedTuple):
    """Consecutive samples of one step; arrays are (n, axes), SI units, at the table.

    A step of more than SEGMENT_SAMPLES samples has several segments with the same `step`.
    """

    step: int
    """Index of the step in the program, from 0."""
    label: str
    kind: str
    position_m: Array
    velocity_m_s: Array
    acceleration_m_s2: Array
    force_offset_n: Array
    first_sample: int
    """Index of the first sample of the segment within the step, from 0."""
    steady: tuple[int, int]
    """Rows [start, stop) at constant speed; (0, 0) = none."""
    profile: Profile | None = None
    """Profile of the step, for set points between samples."""


def plan_step(step: Step, start_m: Array, limits: MotionLimits, period_s: float) -> Profile:
    """Plan one step that starts at `start_m` (axes,)."""
    match step:
        case Move():
            profile = plan_move(step, start_m, limits, period_s)
        case Circle():
            profile = plan_circle(step, start_m)
        case Sine():
            profile = plan_sine(step, start_m)
        case ThereAndBack():
            profile = plan_there_and_back(step, start_m)
        case Dwell():
            profile = standstill(start_m, step.duration_s)
        case Samples():
            profile = plan_samples(step, start_m, period_s)
        case PathMove():
            profile = plan_path(step, start_m, limits, period_s).profile
    return profile


def segments(
    steps: Iterable[Step],
    start_m: Array,
    limits: MotionLimits,
    period_s: float,
    segment_samples: int = SEGMENT_SAMPLES,
    planned: Mapping[int, Profile] = MappingProxyType({}),
) -> Iterator[Segment]:
    """Yield the segments of the program from `start_m` (axes,); only one is in memory at a time.

    `planned`: profiles planned before, by the index of their step, because planning a long path takes longer
    than a period.
    """
    position_m = np.asarray(start_m, dtype=np.float64)
    for index, step in enumerate(steps):
        profile = planned.get(index) or plan_step(step, position_m, limits, period_s)
        count = sample_count(profile.duration_s, period_s)
        steady = _rows_within(profile.steady_s, period_s)
        for first in range(0, count, segment_samples):
            stop = min(first + segment_samples, count)
            time_s = np.minimum(np.arange(first + 1, stop + 1) * period_s, profile.duration_s)
            if stop == count:
                time_s[-1] = profile.duration_s
            motion = profile.at(time_s)
            inside = max(steady[0] - first, 0), min(steady[1], stop) - first
            yield Segment(
                index,
                step.label,
                KIND_OF_STEP[type(step)],
                *motion,
                first_sample=first,
                steady=inside if inside[0] < inside[1] else (0, 0),
                profile=profile,
            )
        position_m = profile.end_m


def sample_count(duration_s: float, period_s: float) -> int:
    """Return the samples of a motion: the last one is at its end or less than a period later."""
    return math.ceil(duration_s / period_s - _GRID_TOLERANCE)


def _rows_within(span_s: tuple[float, float], period_s: float) -> tuple[int, int]:
    """Return the rows [start, stop) whose instants (row + 1) T lie in the span."""
    if span_s[0] >= span_s[1]:
        return 0, 0
    first = math.ceil(span_s[0] / period_s - _GRID_TOLERANCE)
    last = math.floor(span_s[1] / period_s + _GRID_TOLERANCE)
    return max(first - 1, 0), last
