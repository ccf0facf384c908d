"""Evaluates the programmed path over its length: position and derivatives of lines and arcs.

With the length x into an element

    P(x) = base + direction x + R (cos(phi + w x), sin(phi + w x))   in the plane of the arc

where w is the angle per metre of path; a line has R = 0. On a helix the direction is that of the axes
outside the plane, and w R < 1. All derivatives follow: |P''| = R w^2, |P'''| = R |w|^3.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array

Indices = NDArray[np.int64]


class Outline(NamedTuple):
    """n elements; `base_m`, `direction` are (n, axes), `plane` (n, 2), the others (n,)."""

    base_m: Array
    direction: Array
    radius_m: Array
    phase_rad: Array
    turn_rad_m: Array
    """Angle per metre of path, positive counterclockwise."""
    plane: Indices
    length_m: Array


def position(outline: Outline, element: Indices, length_m: Array) -> Array:
    """Return P, (m, axes), at `length_m` (m,) into the elements (m,)."""
    straight = outline.base_m[element] + outline.direction[element] * length_m[:, np.newaxis]
    return _with_circle(straight, outline, element, length_m, 0)


def tangent(outline: Outline, element: Indices, length_m: Array) -> Array:
    """Return P', (m, axes); its norm is 1 except on an arc with drift."""
    return _with_circle(outline.direction[element], outline, element, length_m, 1)


def curvature(outline: Outline, element: Indices, length_m: Array) -> Array:
    """Return P'', 1/m, (m, axes)."""
    straight = np.zeros((len(element), outline.base_m.shape[1]))
    return _with_circle(straight, outline, element, length_m, 2)


def _with_circle(
    straight: Array, outline: Outline, element: Indices, length_m: Array, derivative: int
) -> Array:
    """Add the derivative of order `derivative` of the circular part."""
    rows = np.flatnonzero(outline.radius_m[element])
    if len(rows):
        of = element[rows]
        turn = outline.turn_rad_m[of]
        # each derivative advances the angle by a quarter turn and multiplies by w
        angle = outline.phase_rad[of] + turn * length_m[rows] + 0.5 * np.pi * derivative
        size = outline.radius_m[of] * turn**derivative
        straight[rows, outline.plane[of, 0]] += size * np.cos(angle)
        straight[rows, outline.plane[of, 1]] += size * np.sin(angle)
    return straight
