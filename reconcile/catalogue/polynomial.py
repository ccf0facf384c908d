"""Powers of the position over the travel: what the entries that depend on the position share."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Parameter

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]


def degrees(scenes: Sequence[Scene]) -> list[Shape]:
    """Up to the third power, with the middle and half of the travel."""
    low_m = min(float(scene.motion.position_m.min()) for scene in scenes)
    high_m = max(float(scene.motion.position_m.max()) for scene in scenes)
    return [(k, 0.5 * (low_m + high_m), max(0.5 * (high_m - low_m), 1e-9)) for k in (1.0, 2.0, 3.0)]


def powers(scene: Scene, shape: Shape) -> Array:
    """u, u^2, ... (n, degree), u the position from the middle over half the travel."""
    degree, centre_m, half_m = shape
    u = (scene.motion.position_m - centre_m) / half_m
    return np.stack([u**k for k in range(1, int(degree) + 1)], axis=1)


def coefficients_n(shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """By their power, with where they are measured from."""
    by_power = {f"power_{k}_n": Parameter(float(v), "N") for k, v in enumerate(coefficients, start=1)}
    return {**by_power, "centre_m": Parameter(shape[1], "m"), "half_travel_m": Parameter(shape[2], "m")}
