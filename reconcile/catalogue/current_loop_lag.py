"""Current loop lag: the force follows its command with one pole, or two."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Hypothesis, Parameter, Sense

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]


TIMES_S = (2e-4, 5e-4, 1e-3, 1.5e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6.5e-3, 8e-3)
ORDERS = (1.0, 2.0)
"""One pole, or two equal ones with the same sum of time constants."""


def _shapes(_scenes: Sequence[Scene]) -> list[Shape]:
    return [(time, order) for time in TIMES_S for order in ORDERS]


def _columns(scene: Scene, shape: Shape) -> Array:
    time_s, order = shape
    rate_n_s = np.gradient(scene.model_force_n, scene.period_s)
    column = rate_n_s + (0.25 * time_s * np.gradient(rate_n_s, scene.period_s) if order > 1.0 else 0.0)
    lead: Array = time_s * column[:, None]
    return lead


HYPOTHESES = [
    Hypothesis(Sense.FORCE, _shapes, _columns),
    Hypothesis(Sense.FORCE, _shapes, _columns, per_recording=True),
]
EQUIVALENT = ("transport_delay",)
"""A lag of two poles and a delay differ beyond the bandwidth of what can be seen."""


def parameters(shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """To first order the time is the coefficient's share of the shape's."""
    return {"time_s": Parameter(shape[0] * float(coefficients[0]), "s")}


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"the axis answers {p['time_s'] * 1e3:.2f} ms after the recorded force, in proportion to the "
        "force's rate of change: "
        "a lag of the current loop"
    )
