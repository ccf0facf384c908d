"""Force that depends on the position: a cable chain, a spring, an incline; even in the direction."""

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
    columns: Array = powers(scene, shape)
    return columns


HYPOTHESES = [Hypothesis(Sense.FORCE, degrees, _columns)]
EQUIVALENT = ()


def parameters(shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """Force on the table over half the travel."""
    return coefficients_n(shape, -coefficients)


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    largest_n = max(abs(value) for key, value in p.items() if key.startswith("power"))
    return (
        f"the force changes along the travel, by about {largest_n:.2f} N, alike in "
        "both "
        "directions: a spring, a cable chain or an incline; friction would change its sign"
    )
