"""Paths made of shapes, run on the table of 0.2 m/s, 2 m/s^2 and 50 m/s^3."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from servo_ctrl.motion.path.path_move import Arc, Element, Line, PathMove, plan_path
from servo_ctrl.motion.profile import Motion, MotionLimits
from servo_ctrl.motion.program import segments
from servo_ctrl.motion.violation import Violation, first_violation, stop_at_the_end

Floats = NDArray[np.float64]

T = 1e-3
STILL = math.nan


def limits(velocity: Sequence[float], acceleration: Sequence[float], jerk: Sequence[float]) -> MotionLimits:
    far = np.full(len(velocity), 1.0)
    return MotionLimits(-far, far, np.array(velocity), np.array(acceleration), np.array(jerk), far)


TABLE = limits((0.2, 0.2), (2.0, 2.0), (50.0, 50.0))


def path(
    *shapes: Line | Arc, feed: float = 0.05, tolerance: float = 1e-5, stops: Sequence[int] = ()
) -> PathMove:
    elements = [Element(shape, feed, n + 1, n in stops) for n, shape in enumerate(shapes)]
    return PathMove("p", tuple(elements), tolerance)


def path_violation(step: PathMove, of: MotionLimits, start: Floats | None = None) -> Violation | None:
    start = np.zeros(len(of.force_n)) if start is None else start
    program = list(segments([step], start, of, T))
    return first_violation([*program, stop_at_the_end(program[-1])] if program else [], start, of, T)


def run(step: PathMove, of: MotionLimits = TABLE, instants: int = 20_001) -> tuple[Floats, Motion]:
    plan = plan_path(step, np.zeros(len(of.force_n)), of, T)
    time_s = np.linspace(0.0, plan.profile.duration_s, instants)
    return time_s, plan.profile.at(time_s)


def duration(step: PathMove, of: MotionLimits = TABLE) -> float:
    return plan_path(step, np.zeros(len(of.force_n)), of, T).profile.duration_s


def curve(radius: float, length: float, count: int, decimals: int) -> PathMove:
    """Return a circle of many short lines, as a CAM system writes it."""
    angle = np.arange(1, count + 1) * length / radius
    ends = np.round(np.stack((radius * np.sin(angle), radius * (1.0 - np.cos(angle))), axis=1), decimals)
    return path(*(Line(tuple(end)) for end in ends))
