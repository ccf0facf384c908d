"""Smooth terms: what is real but in no catalogue, told by the coordinate that it lives in.

Each is a set of triangular splines over one coordinate, even in the direction of motion or odd. They locate a
difference, and they are what `unknown` is modelled by.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene

    Array = NDArray[np.float64]

KNOTS = 9


def splines(values: Array, lowest: float, highest: float, knots: int = KNOTS) -> Array:
    """Triangular splines (n, knots) between two bounds, held beyond them; they add up to 1."""
    place = np.clip((values - lowest) / max(highest - lowest, 1e-300), 0.0, 1.0) * (knots - 1)
    return np.maximum(1.0 - np.abs(place[:, None] - np.arange(knots)), 0.0)


def _range(values: Array) -> tuple[float, float]:
    low, high = np.percentile(values, [1.0, 99.0])
    return float(low), float(high)


def _over(values: Array) -> Array:
    return splines(values, *_range(values))


def _logarithm(values: Array, smallest: float) -> Array:
    logs = np.log10(np.maximum(np.abs(values), smallest))
    return splines(logs, float(np.log10(smallest)), float(logs.max()))


def _since(scene: Scene) -> Array:
    m = scene.motion
    return m.last_direction[:, None] * _logarithm(m.since_reversal_m, 1e-7)


SMOOTH_TERMS: dict[str, Callable[[Scene], Array]] = {
    "run_time": lambda scene: _over(scene.time_s),
    "position": lambda scene: _over(scene.motion.position_m),
    "position_by_direction": lambda s: s.motion.direction[:, None] * _over(s.motion.position_m),
    "velocity": lambda scene: _over(scene.motion.velocity_m_s),
    "speed_by_direction": lambda s: (
        s.motion.direction[:, None] * _logarithm(s.motion.velocity_m_s, s.motion.creep_m_s)
    ),
    "acceleration": lambda scene: _over(scene.motion.acceleration_m_s2),
    "force": lambda scene: _over(scene.model_force_n),
    "distance_since_reversal": _since,
}
"""By coordinate: columns (n, k)."""
PREFIX = "unknown:"
"""In front of the coordinate, where a smooth term stands among the candidates."""
