"""Breakaway that grows with the rest before it: Fs(t) = Fs_inf - D exp(-t / tau)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Hypothesis, Parameter, Sense

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]

WAYS_M = (3e-6, 1e-5, 3e-5)
TIMES_S = (0.2, 1.0, 5.0)


def _shapes(scenes: Sequence[Scene]) -> list[Shape]:
    rests_s = np.unique(np.concatenate([scene.motion.dwell_s for scene in scenes]))
    if np.count_nonzero(rests_s > 0.05) < 3:
        return []
    return [(way, time) for way in WAYS_M for time in TIMES_S]


def _columns(scene: Scene, shape: Shape) -> Array:
    m = scene.motion
    way_m, time_s = shape
    grown = -np.expm1(-m.dwell_s / time_s) * np.exp(-m.since_rest_m / way_m)
    column: Array = (m.last_direction * grown)[:, None]
    return column


HYPOTHESES = [Hypothesis(Sense.FORCE, _shapes, _columns)]
EQUIVALENT = ()


def possible(coefficients: Array) -> bool:
    """A rest lets friction grow."""
    return bool(coefficients[0] > 0.0)


def parameters(shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """D, tau, and the way over which the peak is lost."""
    return {
        "growth_n": Parameter(float(coefficients[0]), "N"),
        "time_s": Parameter(shape[1], "s"),
        "way_m": Parameter(shape[0], "m"),
    }


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"the first force after a rest is up to {p['growth_n']:.2f} N higher, the longer the rest "
        f"(time constant about {p['time_s']:.1f} s): breakaway that grows with the dwell"
    )
