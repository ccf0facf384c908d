"""Cumulative lead error: scale less motor grows with the position, alike in both directions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from reconcile.catalogue.kinds import Hypothesis, Parameter, Sense

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]


def _one(_scenes: Sequence[Scene]) -> list[Shape]:
    return [()]


def _columns(scene: Scene, _shape: Shape) -> Array:
    return scene.motion.position_m[:, None].copy()


HYPOTHESES = [Hypothesis(Sense.DEVIATION, _one, _columns)]
EQUIVALENT = ()


def parameters(_shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """Error per travel."""
    return {"relative_error": Parameter(float(coefficients[0]), "")}


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"the scale gains {p['relative_error'] * 1e6:.1f} um per metre on the motor, alike in both "
        "directions and from the "
        "first minute: a lead error; thermal expansion would drift"
    )
