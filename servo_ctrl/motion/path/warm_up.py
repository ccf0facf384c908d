"""Compiles the kernels of path planning, so that the first part program does not wait for them."""

import numpy as np

from servo_ctrl.motion.path.path_move import Element, Line, PathMove, plan_path, true_geometry
from servo_ctrl.motion.profile import MotionLimits

_SIDE_M = 1e-3
_FEED_M_S = 1e-3
_TOLERANCE_M = 1e-5
"""A corner that is rounded: any values that need every kernel."""


def warm_up(limits: MotionLimits, period_s: float) -> None:
    """Plan and evaluate a rounded corner of the machine with these limits.

    The page checks programs in a process that gives way to all others: compiling there takes minutes beside
    a busy computer.
    """
    axes = len(limits.velocity_m_s)
    corners = np.zeros((3, axes))
    corners[1:, 0] = corners[2, -1] = _SIDE_M
    path = tuple(Element(Line(tuple(end_m)), _FEED_M_S, 1, exact_stop=False) for end_m in corners.tolist())
    move, start_m = PathMove("", path, _TOLERANCE_M), np.zeros(axes)
    plan = plan_path(move, start_m, limits, period_s)
    instants_s = np.array([0.0, plan.profile.duration_s])
    plan.profile.at(instants_s)
    plan.element_at(instants_s)
    true_geometry(move, start_m)(corners)
