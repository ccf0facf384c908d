"""Mamdani inference of the fuzzy-PD controller (Xia et al., equations 13-16 and table I).

Inputs are the scaled position error Ke e and its scaled rate of change Kec de/dt, the output is scaled by Ku;
all three live on [-1, 1]. Seven linguistic values NB, NM, NS, ZO, PS, PM, PB with their centres at
-1, -2/3, ..., 1 and triangles that reach to the neighbouring centres. The strength of a rule is the lesser
membership of its two conditions (15). It clips the output value of the rule; clipped values are united by
their maximum, and the output is the centre of gravity of that union.

- Inputs beyond the outermost centres belong entirely to NB or PB (shoulders).
- Output values are seven congruent triangles, of which the outermost reach beyond +-1. So a single value
  gives its centre however much it is clipped, and the output spans [-1, 1]. Triangles cut off at +-1 would
  reach 8/9 at most, and less the more they are clipped.
- The union is piecewise linear, so its area and moment are computed exactly.

The tick interpolates `surface` instead of inferring; the centres of the values are nodes of the surface.
"""

from functools import cache

import numpy as np

from kernels.arrays import Array
from kernels.jit import kernel

VALUES = 7
GAPS = VALUES - 1
SURFACE_POINTS = 145
"""Nodes per side: the interpolation is within 0.5 % of the span (docs/fuzzy_pd.md); 164 kB."""

# table I as printed: rows are the error NB ... PB, columns its change NB ... PB, outputs -3 (NB) ... 3 (PB)
RULES = np.array(
    [
        [-3, -3, -3, -2, -2, -1, 0],
        [-3, -3, -2, -2, -1, 0, 1],
        [-2, -2, -1, -1, 0, 0, 0],
        [-2, -2, -1, 0, 1, 2, 2],
        [0, 0, 0, 1, 1, 2, 2],
        [-1, 0, 1, 2, 2, 3, 3],
        [0, 1, 2, 2, 3, 3, 3],
    ]
)


@kernel
def inferred(error: float, change: float) -> float:
    """Output of the rules in [-1, 1]. Inputs: scaled error and scaled change, clipped to [-1, 1]."""
    row, row_share = _place(error)
    column, column_share = _place(change)
    heights = np.zeros(VALUES)
    for i in range(2):
        for j in range(2):
            strength = min(
                row_share if i == 1 else 1.0 - row_share, column_share if j == 1 else 1.0 - column_share
            )
            value = RULES[row + i, column + j] + GAPS // 2
            heights[value] = max(heights[value], strength)
    return _centre_of_gravity(heights)


@kernel
def _place(scaled: float) -> tuple[int, float]:
    """Index of the centre at or below a scaled input, and the membership of the one above it."""
    place = (min(max(scaled, -1.0), 1.0) + 1.0) * (GAPS / 2)
    below = min(int(place), GAPS - 1)
    return below, place - below


@kernel
def _centre_of_gravity(heights: Array) -> float:
    """Centre of gravity, in [-1, 1], of the union of the output triangles, each clipped at its height (7,).

    Lengths are in gaps between centres.
    """
    area, moment = 0.0, 0.0
    for gap in range(-1, VALUES):
        falling = heights[gap] if gap >= 0 else 0.0
        rising = heights[gap + 1] if gap + 1 < VALUES else 0.0
        if falling == 0.0 and rising == 0.0:
            continue
        # between two kinks, both clipped sides and their maximum are straight
        kinks = np.sort(np.array([0.0, falling, 1.0 - falling, rising, 1.0 - rising, 0.5, 1.0]))
        for k in range(len(kinks) - 1):
            a, b = kinks[k], kinks[k + 1]
            at_a, at_b = _union(a, falling, rising), _union(b, falling, rising)
            part = 0.5 * (at_a + at_b) * (b - a)
            area += part
            moment += part * gap + (b - a) * (at_a * (2.0 * a + b) + at_b * (a + 2.0 * b)) / 6.0
    return (moment / area) / (GAPS / 2) - 1.0


@kernel
def _union(t: float, falling: float, rising: float) -> float:
    """Membership of the union at the share `t` of a gap, in which one value falls and the next one rises."""
    return max(min(1.0 - t, falling), min(t, rising))


@cache
def surface(points: int) -> Array:
    """Evaluate `inferred` at (points, points) nodes over the error (rows) and its change, both from -1 to 1.

    Raises:
        ValueError: `points` is not 6 k + 1, so that the centres of the values would miss the nodes.

    """
    if points < VALUES or points % GAPS != 1:
        raise ValueError(f"{points} nodes do not meet the {VALUES} centres: take 6 k + 1")
    nodes = np.linspace(-1.0, 1.0, points)
    return np.array([[inferred(float(e), float(de)) for de in nodes] for e in nodes])
