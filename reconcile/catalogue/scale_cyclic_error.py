"""Cyclic error of the scale: e sin(2 pi x / p), p the grating period."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Hypothesis, Parameter, Sense
from reconcile.catalogue.periodic import amplitude_and_phase, pair

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]

PERIODS_M = (2e-6, 4e-6, 8e-6, 1e-5, 2e-5, 4e-5, 1e-4, 2e-4, 5e-4, 1e-3)


def _shapes(scenes: Sequence[Scene]) -> list[Shape]:
    return [(period,) for period in PERIODS_M if period < 0.5 * scenes[0].lead_m]


def _columns(scene: Scene, shape: Shape) -> Array:
    return pair(2.0 * np.pi / shape[0] * scene.motion.position_m)


HYPOTHESES = [Hypothesis(Sense.DEVIATION, _shapes, _columns, per_recording=True)]
EQUIVALENT = ()


def parameters(shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """Period, amplitude, and the phase in the first recording."""
    return {"period_m": Parameter(shape[0], "m"), **amplitude_and_phase(coefficients, "m")}


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"the scale swings by {p['amplitude'] * 1e6:.2f} um every {p['period_m'] * 1e6:.1f} um: a cyclic "
        "error within its "
        "grating period; in the force it grows with the square of the speed"
    )
