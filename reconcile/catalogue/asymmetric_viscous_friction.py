"""Viscous friction that differs by direction, Fv+ against Fv-."""

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
    return np.abs(scene.motion.velocity_m_s)[:, None]


HYPOTHESES = [Hypothesis(Sense.FORCE, _one, _columns)]
EQUIVALENT = ()


def parameters(_shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """Half the difference of the two slopes."""
    return {"half_difference_n_s_m": Parameter(float(coefficients[0]), "N s/m")}


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"friction grows with speed by {2.0 * abs(p['half_difference_n_s_m']):.1f} N s/m more in one "
        "direction than "
        "in the other: viscous friction that differs by direction; a constant force would not grow"
    )
