"""Constant force: gravity, a counterbalance, a cable that pulls; even in the direction of motion."""

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
    return np.ones((len(scene.time_s), 1))


HYPOTHESES = [Hypothesis(Sense.FORCE, _one, _columns)]
EQUIVALENT = ("asymmetric_coulomb_friction",)
"""Identical while the axis moves, and where it breaks away."""


def parameters(_shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """The motor has to give c against it, so on the table it is -c."""
    return {"force_n": Parameter(-float(coefficients[0]), "N")}


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"the motor pushes {abs(p['force_n']):.2f} N more in one direction than in the other, at any "
        "speed and "
        "position: a constant force, or Coulomb friction that differs by direction"
    )
