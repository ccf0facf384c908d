"""Powers of the position over the travel: what the entries that depend on the position share."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Parameter

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]


def degrees(_scene: Scene) -> list[Shape]:
    """Up to the third power."""
    return [(1.0,), (2.0,), (3.0,)]


def powers(scene: Scene, shape: Shape) -> Array:
    """u, u^2, ... (n, degree), u the position over half the travel, from its mean."""
    x = scene.motion.position_m - scene.motion.position_m.mean()
    half_m = max(0.5 * float(np.ptp(x)), 1e-9)
    return np.stack([(x / half_m) ** k for k in range(1, int(shape[0]) + 1)], axis=1)


def coefficients_n(coefficients: Array) -> dict[str, Parameter]:
    """By their power."""
    return {f"power_{k}_n": Parameter(float(value), "N") for k, value in enumerate(coefficients, start=1)}
