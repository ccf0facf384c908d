"""Plans paths of straight lines and arcs without stops other than the programmed ones (part programs).

Between exact stops the path is smoothed within its tolerance (`corners`), at the highest speed that feed and
axes allow (`speed`).
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from servo_ctrl.motion.path.corners import STRAIGHT_ON_RAD, tangent_and_curvature_jumps
from servo_ctrl.motion.path.distance import boxes, nearest
from servo_ctrl.motion.path.fastest_layout import fastest
from servo_ctrl.motion.path.programmed_path import Indices, Outline
from servo_ctrl.motion.path.speed import place_at
from servo_ctrl.motion.path.zones import smoothed_path
from servo_ctrl.motion.profile import Motion, MotionLimits, Profile, ProgramBlock, standstill

_Row = tuple[list[float], list[float], float, float, float, tuple[int, int], float]


SHORTEST_M = 1e-12
"""Shorter elements, metres, are dropped; the next one starts at the end of the last kept one; chosen."""


class Line(NamedTuple):
    """A straight line."""

    end_m: tuple[float, ...]
    """Absolute target of every axis, in machine order; NaN = it stays where it is."""


class Arc(NamedTuple):
    """An arc in the plane of two axes; the other axes move in proportion to the angle (helix), or rest.

    An arc that ends in the plane where it starts is a full circle.
    """

    end_m: tuple[float, ...]
    """Absolute target of every axis, in machine order; NaN = it stays where it is."""
    centre_m: tuple[float, float]
    """Absolute position in the plane."""
    axes: tuple[int, int]
    """Indices of the axes of the plane; counterclockwise is from the first to the second."""
    counterclockwise: bool


class Element(NamedTuple):
    """One piece of the path, its feed and whether the axes stop at its end."""

    shape: Line | Arc
    feed_m_s: float
    """Speed along the path; infinite = as fast as the axes allow (G0)."""
    line: int
    """Line of the part program, for messages."""
    exact_stop: bool
    """Whether the axes come to rest at its end."""


class PathMove(NamedTuple):
    """A programmed path from rest to rest."""

    label: str
    elements: tuple[Element, ...]
    tolerance_m: float
    """Bound of corner rounding; 0 = exact stop at every corner."""


class PathPlan(NamedTuple):
    """A planned path: its motion, its length and the element of each instant."""

    profile: Profile
    length_m: float
    """Length of the programmed path."""
    element_at: Callable[[Array], Indices]
    """Index of the element at each of the instants (n,), seconds."""


def plan_path(step: PathMove, start_m: Array, limits: MotionLimits, period_s: float) -> PathPlan:
    """Plan the path from `start_m` (axes,) so that every sample keeps within the limits."""
    outline, index, end_m = _outline(step, start_m)
    if not len(index):
        return PathPlan(standstill(end_m), 0.0, lambda time_s: np.zeros(len(time_s), dtype=np.int64))
    feed_m_s = np.array([element.feed_m_s for element in step.elements])[index]
    stops = _stops(step, outline, index)
    zones, run = fastest(
        outline,
        feed_m_s=feed_m_s,
        stops=stops,
        tolerance_m=step.tolerance_m,
        limits=limits,
        period_s=period_s,
    )
    duration_s = float(run.time_s[-1])

    def at(time_s: Array) -> Motion:
        place = place_at(run, zones, time_s)
        position_m, tangent, curvature = smoothed_path(outline, zones, place.zone, place.into_m)
        speed, acceleration = place.speed_m_s[:, np.newaxis], place.acceleration_m_s2[:, np.newaxis]
        acceleration = curvature * speed**2 + tangent * acceleration
        motion = Motion(position_m, tangent * speed, acceleration, np.zeros_like(position_m))
        arrived = time_s >= duration_s
        motion.position_m[arrived] = end_m
        motion.velocity_m_s[arrived] = motion.acceleration_m_s2[arrived] = 0.0
        return motion

    def element_at(time_s: Array) -> Indices:
        return np.asarray(index[zones.element[place_at(run, zones, time_s).zone]])

    def block_at(time_s: float) -> ProgramBlock:
        element = step.elements[int(element_at(np.array([time_s]))[0])]
        return ProgramBlock(element.line, math.isinf(element.feed_m_s))

    profile = Profile(duration_s, end_m, at, block_at=block_at)
    return PathPlan(profile, float(zones.end_m[-1]), element_at)


def true_geometry(step: PathMove, start_m: Array) -> Callable[[Array], tuple[Array, Indices]]:
    """Return a function that measures contour errors against the programmed path, without rounding.

    It takes points (n, axes) and returns their distances (n,), metres, and the indices of nearest elements.
    """
    outline, index, end_m = _outline(step, start_m)
    tree = boxes(outline) if len(index) else None

    def nearest_elements(points_m: Array) -> tuple[Array, Indices]:
        if tree is None:
            return np.linalg.norm(points_m - end_m, axis=1), np.zeros(len(points_m), dtype=np.int64)
        distance_m, row = nearest(outline, tree, np.ascontiguousarray(points_m, dtype=np.float64))
        return distance_m, index[row]

    return nearest_elements


def _outline(step: PathMove, start_m: Array) -> tuple[Outline, Indices, Array]:
    """Return the elements that have a length, their indices, and the end of the path (axes,)."""
    rows, index = [], []
    at_m = end_m = [float(value) for value in start_m]
    for number, element in enumerate(step.elements):
        shape = element.shape
        end_m = [a if math.isnan(b) else float(b) for a, b in zip(at_m, shape.end_m, strict=True)]
        row = _line(at_m, end_m) if isinstance(shape, Line) else _arc(at_m, end_m, shape)
        if row[-1] > SHORTEST_M:
            rows.append(row)
            index.append(number)
            at_m = end_m
    columns = zip(*rows, strict=True) if rows else [[]] * 7
    outline = Outline(*(np.array(column) for column in columns))
    return outline, np.array(index, dtype=np.int64), np.array(end_m)


def _line(start_m: list[float], end_m: list[float]) -> _Row:
    length_m = math.dist(start_m, end_m)
    direction = [(b - a) / length_m if length_m else 0.0 for a, b in zip(start_m, end_m, strict=True)]
    return start_m, direction, 0.0, 0.0, 0.0, (0, 0), length_m


def _arc(start_m: list[float], end_m: list[float], arc: Arc) -> _Row:
    """Make an arc; a radius that differs at its end drifts in proportion to the angle."""
    first, second = arc.axes
    centre = arc.centre_m
    x, y = start_m[first] - centre[0], start_m[second] - centre[1]
    to_x, to_y = end_m[first] - centre[0], end_m[second] - centre[1]
    radius_m, phase = math.hypot(x, y), math.atan2(y, x)
    sense = 1.0 if arc.counterclockwise else -1.0
    turn = sense * (math.atan2(to_y, to_x) - phase) % math.tau
    if (x, y) == (to_x, to_y):
        turn = math.tau
    drift = [b - a for a, b in zip(start_m, end_m, strict=True)]
    drift[first] = to_x - radius_m * math.cos(phase + sense * turn)
    drift[second] = to_y - radius_m * math.sin(phase + sense * turn)
    # an upper bound of the length: the drift in the plane is not normal to the circle
    beside = (value for axis, value in enumerate(drift) if axis not in arc.axes)
    length_m = math.hypot(radius_m * turn + math.hypot(drift[first], drift[second]), *beside)
    base = list(start_m)
    base[first], base[second] = centre
    direction = [value / length_m if length_m else 0.0 for value in drift]
    return base, direction, radius_m, phase, sense * turn / length_m if length_m else 0.0, arc.axes, length_m


def _stops(step: PathMove, outline: Outline, index: Indices) -> NDArray[np.bool_]:
    """Return after which elements of the outline the axes stop, (n,)."""
    exact = np.array([element.exact_stop for element in step.elements])
    # a dropped element passes its stop on to the one before it
    after = np.append(index[1:], len(exact)) - 1
    counted = np.concatenate(([0], np.cumsum(exact)))
    stops = counted[after + 1] > counted[index]
    if step.tolerance_m == 0.0:
        stops[:-1] |= np.linalg.norm(tangent_and_curvature_jumps(outline)[0], axis=1) > STRAIGHT_ON_RAD
    stops[-1] = True
    return np.asarray(stops)
