"""A torque constant that falls at high current, Kt(i) = Kt (1 - c i^2)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Hypothesis, Parameter, Sense

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]


def _strongest(scenes: Sequence[Scene]) -> list[Shape]:
    strongest_n = max(float(np.abs(scene.model_force_n).max()) for scene in scenes)
    return [(strongest_n,)] if strongest_n > 0.0 else []


def _columns(scene: Scene, shape: Shape) -> Array:
    return (scene.model_force_n * (scene.model_force_n / shape[0]) ** 2)[:, None]


HYPOTHESES = [Hypothesis(Sense.FORCE, _strongest, _columns)]
EQUIVALENT = ()


def possible(coefficients: Array) -> bool:
    """Force is lost, not won."""
    return bool(coefficients[0] > 0.0)


def parameters(shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """Share of the force that is missing at the strongest force of the recording."""
    return {"loss_at_peak": Parameter(float(coefficients[0]), ""), "peak_n": Parameter(shape[0], "N")}


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"at the strongest force {100.0 * p['loss_at_peak']:.1f} % of what the current promises are "
        "missing, and "
        "less than in proportion below: the torque constant saturates"
    )
