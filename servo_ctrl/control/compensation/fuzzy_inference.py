"""Mamdani inference of the fuzzy-PD controller (Xia et al., equations 13-16 and table I).

Inputs are the scaled position error Ke e and its scaled rate of change Kec de/dt, the output is scaled by Ku;
all three live on [-1, 1]. Seven linguistic values NB, NM, NS, ZO, PS, PM, PB with their centres at
-1, -2/3, ..., 1 and triangles that reach to the centres beside them. A rule counts as much as the lesser of
its two conditions (15), it clips the output value it names, clipped values are united by their maximum, and
the output is the centre of gravity of that union.

- Inputs beyond the outermost centres belong to NB or PB wholly: shoulders.
- Output values are seven congruent triangles, the outermost reach beyond +-1. Then a value that is alone
  gives its centre however much it is clipped, and the output spans the whole of [-1, 1]. Triangles cut off
  at +-1 would reach 8/9 at best, and would come back from there the more they are clipped.
- The union is linear piece by piece, so its area and moment are exact; nothing is sampled.

The tick does not infer: it interpolates `surface`, whose nodes lie on the centres of the values.
"""

from functools import cache

import numpy as np

from kernels.arrays import Array
from kernels.jit import kernel

VALUES = 7
GAPS = VALUES - 1
SURFACE_POINTS = 145
"""Nodes a side: interpolated, it is within 0.5 % of the span of the inference (docs/fuzzy_pd.md); 164 kB."""

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
    """Output of the rules in [-1, 1] for a scaled error and its scaled change, clipped to [-1, 1]."""
    row, row_share = _place(error)
    column, column_share = _place(change)
    heights = np.zeros(VALUES)
    for i in range(2):
        for j in range(2):
            met = min(
                row_share if i == 1 else 1.0 - row_share, column_share if j == 1 else 1.0 - column_share
            )
            value = RULES[row + i, column + j] + GAPS // 2
            heights[value] = max(heights[value], met)
    return _centre_of_gravity(heights)


@kernel
def _place(scaled: float) -> tuple[int, float]:
    """Index of the centre at or below a scaled input, and the membership of the one above it."""
    place = (min(max(scaled, -1.0), 1.0) + 1.0) * (GAPS / 2)
    below = min(int(place), GAPS - 1)
    return below, place - below


@kernel
def _centre_of_gravity(heights: Array) -> float:
    """Centre of the union of the output triangles, each clipped at its height; in [-1, 1].

    Lengths count in gaps between centres, from the middle of the range.
    """
    area, moment = 0.0, 0.0
    for gap in range(-1, VALUES):
        falling = heights[gap] if gap >= 0 else 0.0
        rising = heights[gap + 1] if gap + 1 < VALUES else 0.0
        if falling == 0.0 and rising == 0.0:
            continue
        # between these, each of the two clipped sides and their maximum are straight
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
    """Membership of the union at the share `t` of a gap: one value falls there, the next one rises."""
    return max(min(1.0 - t, falling), min(t, rising))


@cache
def surface(points: int) -> Array:
    """`inferred` at (points, points) nodes over the error (rows) and its change, both from -1 to 1.

    Raises:
        ValueError: `points` is not 6 k + 1, so that the centres of the values would miss the nodes.

    """
    if points < VALUES or points % GAPS != 1:
        raise ValueError(f"{points} nodes do not meet the {VALUES} centres: take 6 k + 1")
    nodes = np.linspace(-1.0, 1.0, points)
    return np.array([[inferred(float(e), float(de)) for de in nodes] for e in nodes])
