"""Presliding: friction that builds up over the way since the reversal (Dahl 1968; LuGre and GMS alike).

Dahl's exponent tells how: 1 is the bristle's exponential, below it the contact gives way at last and at once,
above it long before.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from reconcile.catalogue.kinds import Hypothesis, Parameter, Sense
from reconcile.kinematics import bristles

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]

WAYS_M = (1e-6, 2e-6, 4e-6, 8e-6, 1.5e-5, 3e-5, 6e-5, 1.2e-4)

EXPONENTS = (1.0, 0.5, 2.0)


def _shapes(_scenes: Sequence[Scene]) -> list[Shape]:
    """The way over which 63 % build up from rest, as the exponential's, and the exponent."""
    return [(way, exponent) for way in WAYS_M for exponent in EXPONENTS]


def _columns(scene: Scene, shape: Shape) -> Array:
    m, (way_m, exponent) = scene.motion, shape
    return (bristles(m.position_m, way_m / _built_up_over(exponent), exponent) - m.direction)[:, None]


def _built_up_over(exponent: float) -> float:
    """Way over which 1 - 1/e build up, for dz/dx = (1 - z)^exponent."""
    power = 1.0 - exponent
    return -math.expm1(-power) / power if power else 1.0


HYPOTHESES = [Hypothesis(Sense.FORCE, _shapes, _columns)]
EQUIVALENT = ()


def possible(coefficients: Array) -> bool:
    """Friction that builds up."""
    return bool(coefficients[0] > 0.0)


def parameters(shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """Friction that builds up, the way over which 63 % of it do, and how."""
    return {
        "level_n": Parameter(float(coefficients[0]), "N"),
        "way_m": Parameter(shape[0], "m"),
        "exponent": Parameter(shape[1], ""),
    }


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"after a reversal {abs(p['level_n']):.2f} N of friction build up over {p['way_m'] * 1e6:.1f} um "
        "of way, "
        "whatever the speed: presliding; Stribeck friction would show at slow constant speeds too"
    )
