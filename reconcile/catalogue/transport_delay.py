"""Transport delay: the force acts, or the position is told, later."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Hypothesis, Parameter, Sense

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]

TIMES_S = (2e-4, 4e-4, 6e-4, 8e-4, 1e-3, 1.3e-3, 1.7e-3, 2.2e-3, 3e-3, 4e-3, 6e-3, 8e-3)


def _shapes(_scenes: Sequence[Scene]) -> list[Shape]:
    return [(time,) for time in TIMES_S]


def _columns(scene: Scene, shape: Shape) -> Array:
    early_n = np.interp(scene.time_s + shape[0], scene.time_s, scene.model_force_n)
    return (early_n - scene.model_force_n)[:, None]


HYPOTHESES = [
    Hypothesis(Sense.FORCE, _shapes, _columns),
    Hypothesis(Sense.FORCE, _shapes, _columns, per_recording=True),
]
EQUIVALENT = ("current_loop_lag",)
"""A lag of two poles and a delay differ beyond the bandwidth of what can be seen."""


def parameters(shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """To first order the time is the coefficient's share of the shape's."""
    return {"time_s": Parameter(shape[0] * float(coefficients[0]), "s")}


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"the axis answers {p['time_s'] * 1e3:.2f} ms after the recorded force, in proportion to the "
        "force's rate of change: "
        "a delay between the channels"
    )
