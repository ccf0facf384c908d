"""Thermal expansion: scale less motor drifts slowly, in proportion to the position."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Hypothesis, Parameter, Sense

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]

TIMES_S = (10.0, 30.0, 100.0, 400.0)


def _shapes(scenes: Sequence[Scene]) -> list[Shape]:
    first_k = scenes[0].temperature_k
    if all(scene.temperature_k is not None for scene in scenes) and first_k is not None:
        return [(0.0, float(first_k[0]))]
    longest_s = max(float(scene.time_s[-1]) for scene in scenes)
    return [(time, 0.0) for time in TIMES_S if time < 5.0 * longest_s]


def _columns(scene: Scene, shape: Shape) -> Array:
    if shape[0] == 0.0 and scene.temperature_k is not None:
        warmth = scene.temperature_k - shape[1]
    else:
        warmth = -np.expm1(-scene.time_s / shape[0])
    x = scene.motion.position_m
    if shape[0] == 0.0:
        return np.stack((x * warmth, warmth), axis=1)
    return np.stack((x * warmth, warmth, x), axis=1)  # how warm it was at the start is not known


HYPOTHESES = [
    Hypothesis(Sense.DEVIATION, _shapes, _columns),
    Hypothesis(Sense.DEVIATION, _shapes, _columns, per_recording=True),
]
EQUIVALENT = ()


def parameters(shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """Growth per metre (per kelvin where the temperature was recorded), and what it is measured from."""
    growth = float(coefficients[0])
    found = {"growth": Parameter(growth, "1/K" if shape[0] == 0.0 else "")}
    if growth != 0.0:
        found["fixed_end_m"] = Parameter(-float(coefficients[1]) / growth, "m")
    return found if shape[0] == 0.0 else {**found, "time_s": Parameter(shape[0], "s")}


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"the scale drifts away from the motor in proportion to the position, by {p['growth'] * 1e6:.1f} "
        "um/m: the screw "
        "grows as it warms; a lead error would have been there from the start"
    )
