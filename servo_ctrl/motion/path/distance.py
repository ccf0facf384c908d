"""Computes the exact distance of points to the programmed path with a tree of bounding boxes.

Node k of the tree has the children 2 k + 1 and 2 k + 2; the leaves are the elements, in order. The search
for a point begins at the element nearest to the previous point, so that most boxes are pruned at once.
"""

import math

import numpy as np

from kernels.arrays import Array
from kernels.jit import kernel
from servo_ctrl.motion.path.programmed_path import Indices, Outline, position

_Circle = tuple[float, float, float]

_GRID = 16
"""Start points of the Newton search along a helix; chosen."""


def boxes(outline: Outline) -> Array:
    """Return the bounding box of each node, (nodes, 2, axes): lowest and highest corner."""
    count = len(outline.length_m)
    every = np.arange(count)
    start_m, end_m = position(outline, every, np.zeros(count)), position(outline, every, outline.length_m)
    # an arc exceeds the box of its ends by at most its sagitta, beyond a semicircle by the diameter
    angle = np.minimum(np.abs(outline.turn_rad_m) * outline.length_m, math.tau)
    beyond_m = outline.radius_m * np.where(angle < math.pi, 1.0 - np.cos(0.5 * angle), 2.0)
    leaves = 2 ** math.ceil(math.log2(count))
    tree = np.empty((2 * leaves - 1, 2, start_m.shape[1]))
    tree[:, 0], tree[:, 1] = np.inf, -np.inf
    tree[leaves - 1 : leaves - 1 + count, 0] = np.minimum(start_m, end_m) - beyond_m[:, np.newaxis]
    tree[leaves - 1 : leaves - 1 + count, 1] = np.maximum(start_m, end_m) + beyond_m[:, np.newaxis]
    width = leaves // 2
    while width:
        rows, below = slice(width - 1, 2 * width - 1), slice(2 * width - 1, 4 * width - 1)
        tree[rows, 0] = tree[below, 0].reshape(width, 2, -1).min(axis=1)
        tree[rows, 1] = tree[below, 1].reshape(width, 2, -1).max(axis=1)
        width //= 2
    return tree


@kernel
def _to_box(point: Array, box: Array) -> float:
    """Return the squared distance to a box; infinite for an empty one."""
    total = 0.0
    for axis in range(len(point)):
        total += max(box[0, axis] - point[axis], point[axis] - box[1, axis], 0.0) ** 2
    return total


@kernel
def _to_line(point: Array, base: Array, direction: Array, length: float) -> float:
    """Return the squared distance to a line."""
    s = 0.0
    for axis in range(len(point)):
        s += (point[axis] - base[axis]) * direction[axis]
    s = min(max(s, 0.0), length)
    total = 0.0
    for axis in range(len(point)):
        total += (point[axis] - base[axis] - s * direction[axis]) ** 2
    return total


@kernel
def _to_arc(
    point: Array, base: Array, direction: Array, circle: _Circle, plane: Indices, length: float
) -> float:
    """Return the squared distance to an arc (radius, phase, turn): in closed form, for a helix by Newton."""
    _, phase, turn = circle
    best = min(
        _to_place(point, base, direction, circle, plane, 0.0)[0],
        _to_place(point, base, direction, circle, plane, length)[0],
    )
    drift = 0.0
    for axis in range(len(point)):
        drift = max(drift, abs(direction[axis]) * length)
    if drift < 1e-12:
        angle = math.atan2(point[plane[1]] - base[plane[1]], point[plane[0]] - base[plane[0]])
        s = (math.copysign(1.0, turn) * (angle - phase) % math.tau) / abs(turn)
        if s < length:
            best = min(best, _to_place(point, base, direction, circle, plane, s)[0])
        return best
    for start in range(_GRID):
        s = length * (start + 0.5) / _GRID
        for _ in range(8):
            square, first_derivative, second_derivative = _to_place(point, base, direction, circle, plane, s)
            best = min(best, square)
            if second_derivative <= 0.0:
                break
            s = min(max(s - first_derivative / second_derivative, 0.0), length)
    return best


@kernel
def _to_place(
    point: Array, base: Array, direction: Array, circle: _Circle, plane: Indices, s: float
) -> tuple[float, float, float]:
    """Return the squared distance to the point s of an arc, and half its derivatives by s."""
    radius, phase, turn = circle
    x, y = radius * math.cos(phase + turn * s), radius * math.sin(phase + turn * s)
    square = first_derivative = second_derivative = 0.0
    for axis in range(len(point)):
        off, d1, d2 = base[axis] + direction[axis] * s - point[axis], direction[axis], 0.0
        if axis == plane[0]:
            off, d1, d2 = off + x, d1 - turn * y, -(turn**2) * x
        elif axis == plane[1]:
            off, d1, d2 = off + y, d1 + turn * x, -(turn**2) * y
        square += off**2
        first_derivative += off * d1
        second_derivative += d1**2 + off * d2
    return square, first_derivative, second_derivative


@kernel
def nearest(outline: Outline, boxes_m: Array, points_m: Array) -> tuple[Array, Indices]:
    """Return distances m (n,) of the points (n, axes), C-contiguous, to the path, and nearest elements."""
    base_m, direction, radius_m, phase_rad, turn_rad_m, plane, length_m = outline
    leaves = (len(boxes_m) + 1) // 2
    distance_m, element = np.empty(len(points_m)), np.zeros(len(points_m), dtype=np.int64)
    stack, squares = np.empty(128, dtype=np.int64), np.empty(128)
    before = 0
    for n in range(len(points_m)):
        point, best, nearest_element = points_m[n], np.inf, before
        # visit the leaf of the previous point first, then the tree from its root
        stack[0], squares[0], stack[1], squares[1], depth = 0, 0.0, leaves - 1 + before, 0.0, 2
        while depth:
            depth -= 1
            node = stack[depth]
            if squares[depth] >= best:
                continue
            if node >= leaves - 1:
                e = node - leaves + 1
                if radius_m[e] > 0.0:
                    circle = radius_m[e], phase_rad[e], turn_rad_m[e]
                    square = _to_arc(point, base_m[e], direction[e], circle, plane[e], length_m[e])
                else:
                    square = _to_line(point, base_m[e], direction[e], length_m[e])
                if square < best:
                    best, nearest_element = square, e
                continue
            left, right = 2 * node + 1, 2 * node + 2
            to_left, to_right = _to_box(point, boxes_m[left]), _to_box(point, boxes_m[right])
            if to_left < to_right:  # pop the nearer child first
                left, right, to_left, to_right = right, left, to_right, to_left
            stack[depth], squares[depth] = left, to_left
            stack[depth + 1], squares[depth + 1] = right, to_right
            depth += 2
        distance_m[n], element[n] = math.sqrt(best), nearest_element
        before = nearest_element
    return distance_m, element
