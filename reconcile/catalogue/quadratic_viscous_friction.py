"""Quadratic viscous friction, F2 v |v|."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Hypothesis, Parameter, Sense

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]


def _one(_scenes: Sequence[Scene]) -> list[Shape]:
    return [()]


def _columns(scene: Scene, _shape: Shape) -> Array:
    v = scene.motion.velocity_m_s
    return (v * np.abs(v))[:, None]


HYPOTHESES = [Hypothesis(Sense.FORCE, _one, _columns)]
EQUIVALENT = ()


def parameters(_shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """F2; negative where friction grows slower than the speed."""
    return {"quadratic_n_s2_m2": Parameter(float(coefficients[0]), "N s^2/m^2")}


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"friction bends over speed, by {p['quadratic_n_s2_m2']:.1f} N s^2/m^2 v |v| in both directions alike"
    )
