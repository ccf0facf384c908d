"""Coupling between axes: a force or an error that follows another axis."""

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


def _force(scene: Scene, _shape: Shape) -> Array:
    others = list(scene.others.values())
    columns = [motion.velocity_m_s for motion in others] + [motion.acceleration_m_s2 for motion in others]
    return np.stack(columns, axis=1) if columns else np.zeros((len(scene.time_s), 0))


def _deviation(scene: Scene, _shape: Shape) -> Array:
    columns = [motion.position_m for motion in scene.others.values()]
    return np.stack(columns, axis=1) if columns else np.zeros((len(scene.time_s), 0))


HYPOTHESES = [Hypothesis(Sense.FORCE, _one, _force), Hypothesis(Sense.DEVIATION, _one, _deviation)]
EQUIVALENT = ()


def parameters(_shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """One coefficient a column."""
    return {f"coefficient_{k + 1}": Parameter(float(value), "") for k, value in enumerate(coefficients)}


def sentence(_p: dict[str, float]) -> str:
    """What can be checked."""
    return "the error follows the motion of another axis: the axes are coupled"
