"""Backlash: scale less motor steps after each reversal, by the play, whatever the force."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numba
import numpy as np

from reconcile.catalogue.kinds import Hypothesis, Parameter, Sense

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]

PLAYS_M = (2.5e-7, 5e-7, 1e-6, 2e-6, 3e-6, 5e-6, 8e-6, 1.2e-5, 1.8e-5, 2.5e-5)


def _shapes(_scenes: Sequence[Scene]) -> list[Shape]:
    return [(play,) for play in PLAYS_M]


@numba.njit(cache=True)
def _play(position_m: Array, half_m: float) -> Array:
    """Table of a motor at `position_m` with `half_m` of play to either side, less the motor."""
    table = np.zeros(len(position_m))
    place = position_m[0]
    for i in range(len(position_m)):
        place = min(max(place, position_m[i] - half_m), position_m[i] + half_m)
        table[i] = place - position_m[i]
    return table


def _columns(scene: Scene, shape: Shape) -> Array:
    return (_play(scene.motion.position_m, shape[0]) / shape[0])[:, None]


HYPOTHESES = [Hypothesis(Sense.DEVIATION, _shapes, _columns)]
EQUIVALENT = ()


def possible(coefficients: Array) -> bool:
    """No play is negative."""
    return bool(coefficients[0] > 0.0)


def parameters(_shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """Half of the total play."""
    return {"play_m": Parameter(float(coefficients[0]), "m")}


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"the scale steps {2e6 * p['play_m']:.1f} um after each reversal whatever the force: backlash; "
        "compliance "
        "would grow with force"
    )
