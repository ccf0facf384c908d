"""A path of straight lines and arcs, run without a rest where none is asked for (part programs).

Between exact stops the path is smoothed within its tolerance (`path_corners`) and run as fast as feed
and axes allow (`path_speed`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import NDArray

    from servo_ctrl.motion.profile import Array, MotionLimits, Profile

    Indices = NDArray[np.int64]


class Line(NamedTuple):
    """Straight to `end_m`."""

    end_m: tuple[float, ...]
    """Absolute target of every axis, in machine order; NaN = it stays where it is."""


class Arc(NamedTuple):
    """Circular in the plane of two axes; the others move in proportion to the angle (helix), or stay.

    Where it ends in the plane where it started it is a full circle.
    """

    end_m: tuple[float, ...]
    """Absolute target of every axis, in machine order; NaN = it stays where it is."""
    centre_m: tuple[float, float]
    """Absolute, in the plane."""
    axes: tuple[int, int]
    """Indices of the axes of the plane; counterclockwise is from the first to the second."""
    counterclockwise: bool


class Element(NamedTuple):
    """One piece of the path and how it is run."""

    shape: Line | Arc
    feed_m_s: float
    """Speed along the path; infinite = what the axes allow (G0)."""
    line: int
    """Line of the part program, for messages."""
    exact_stop: bool
    """Come to rest at its end."""


class PathMove(NamedTuple):
    """What is asked for: one path, from rest to rest."""

    label: str
    elements: tuple[Element, ...]
    tolerance_m: float
    """Corners are rounded within it; 0 = exact stop at every corner."""


class PathPlan(NamedTuple):
    """A path, planned, with what a report needs beside the motion."""

    profile: Profile
    length_m: float
    """Of the programmed path."""
    element_at: Callable[[Array], Indices]
    """Index of the element that is run at each of the instants (n,), seconds."""


class TrueGeometry(NamedTuple):
    """The programmed path as it is written, without rounding."""

    nearest: Callable[[Array], tuple[Array, Indices]]
    """Distance m of each of the points (n, axes) to the path, and the index of the nearest element."""

    def distance_m(self, points_m: Array) -> Array:
        """Distance of each of the points (n, axes) to the path, (n,)."""
        return self.nearest(points_m)[0]


def planned(step: PathMove, start_m: Array, limits: MotionLimits, period_s: float) -> PathPlan:
    """The path from `start_m` (axes,), which keeps within the limits at every sample."""
    raise NotImplementedError


def plan_path(step: PathMove, start_m: Array, limits: MotionLimits, period_s: float) -> Profile:
    """The motion alone."""
    return planned(step, start_m, limits, period_s).profile


def true_geometry(step: PathMove, start_m: Array) -> TrueGeometry:
    """What a contour error is measured against."""
    raise NotImplementedError
