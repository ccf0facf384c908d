"""Friction that depends on the position, s Fc(x): it changes its sign with the direction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Hypothesis, Parameter, Sense

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]


def _shapes(_scene: Scene) -> list[Shape]:
    return [(1.0,), (2.0,), (3.0,)]


def _columns(scene: Scene, shape: Shape) -> Array:
    m = scene.motion
    x = m.position_m - m.position_m.mean()
    span_m = max(float(np.ptp(m.position_m)), 1e-9)
    powers = np.stack([(2.0 * x / span_m) ** k for k in range(1, int(shape[0]) + 1)], axis=1)
    columns: Array = m.direction[:, None] * powers
    return columns


HYPOTHESES = [Hypothesis(Sense.FORCE, _shapes, _columns)]
EQUIVALENT = ()


def parameters(_shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """Change of the friction level over half the travel."""
    return {f"power_{k + 1}_n": Parameter(float(value), "N") for k, value in enumerate(coefficients)}


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"friction differs along the travel, by about {max(abs(v) for v in p.values()):.2f} N, and "
        "changes its sign "
        "with the direction: position-dependent friction; a spring or cable would not"
    )
