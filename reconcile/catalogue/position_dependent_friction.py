"""Friction that depends on the position, s Fc(x): it changes its sign with the direction."""

from __future__ import annotations

from typing import TYPE_CHECKING

from reconcile.catalogue.kinds import Hypothesis, Sense
from reconcile.catalogue.polynomial import coefficients_n, degrees, powers

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Parameter, Scene, Shape

    Array = NDArray[np.float64]


def _columns(scene: Scene, shape: Shape) -> Array:
    columns: Array = scene.motion.direction[:, None] * powers(scene, shape)
    return columns


HYPOTHESES = [Hypothesis(Sense.FORCE, degrees, _columns)]
EQUIVALENT = ()


def parameters(shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """Change of the friction level over half the travel."""
    return coefficients_n(shape, coefficients)


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    largest_n = max(abs(value) for key, value in p.items() if key.startswith("power"))
    return (
        f"friction differs along the travel, by about {largest_n:.2f} N, and "
        "changes its sign "
        "with the direction: position-dependent friction; a spring or cable would not"
    )
