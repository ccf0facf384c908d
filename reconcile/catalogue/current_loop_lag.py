"""Current loop lag: the force follows as a first-order lag."""

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
    return np.gradient(scene.model_force_n, scene.period_s)[:, None]


HYPOTHESES = [Hypothesis(Sense.FORCE, _one, _columns)]
EQUIVALENT = ()


def parameters(_shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """The command that a lagging force needs is force plus tau dF/dt."""
    return {"time_s": Parameter(float(coefficients[0]), "s")}


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"the axis answers {p['time_s'] * 1e3:.2f} ms after the recorded force, in proportion to the "
        "force's rate of change: "
        "a lag of the current loop"
    )
