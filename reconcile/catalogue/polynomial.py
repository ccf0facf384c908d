"""Shared by the position-dependent effects: powers of the position over the travel."""

from collections.abc import Sequence

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.conversion import IdentifiedTerms, ModelEffect, ModelTerm
from reconcile.catalogue.kinds import RegressionData, ShapeParameters, SiParameter

LEAST_PASSES = 1.5
"""Least distance moved, in travels, that tells a force at a place from one at a moment. Chosen."""


def passed_once(found: IdentifiedTerms) -> str:
    """Return why nothing is known to depend on the place (`CatalogueEntry.refused`); empty if it is."""
    low_m, high_m = _travel_m(found.datasets)
    moved_m = sum(float(np.abs(np.diff(data.motion.position_m)).sum()) for data in found.datasets)
    if moved_m >= LEAST_PASSES * (high_m - low_m):
        return ""
    return "each place is passed once, so it may as well depend on the time: move to and fro"


def degrees(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    """Degrees 1 to 3, each with the middle and half of the travel, m."""
    low_m, high_m = _travel_m(datasets)
    return [(k, 0.5 * (low_m + high_m), max(0.5 * (high_m - low_m), 1e-9)) for k in (1.0, 2.0, 3.0)]


def _travel_m(datasets: Sequence[RegressionData]) -> tuple[float, float]:
    low_m = min(float(data.motion.position_m.min()) for data in datasets)
    high_m = max(float(data.motion.position_m.max()) for data in datasets)
    return low_m, high_m


def powers(data: RegressionData, shape: ShapeParameters) -> Array:
    """u, u^2, ... (n, degree), u the position from the middle over half the travel."""
    degree, centre_m, half_m = shape
    u = (data.motion.position_m - centre_m) / half_m
    return np.stack([u**k for k in range(1, int(degree) + 1)], axis=1)


def coefficients_n(shape: ShapeParameters, coefficients: Array) -> dict[str, SiParameter]:
    """Coefficients by power, N, with the middle and half of the travel, m."""
    by_power = {f"power_{k}_n": SiParameter(float(v), "N") for k, v in enumerate(coefficients, start=1)}
    return {**by_power, "centre_m": SiParameter(shape[1], "m"), "half_travel_m": SiParameter(shape[2], "m")}


def largest_n(parameters: dict[str, float]) -> float:
    """Largest of the coefficients, N."""
    return max(abs(value) for key, value in parameters.items() if key.startswith("power"))


def cubic(of: ModelEffect, sign: float) -> list[ModelTerm]:
    """A plant's cubic times `sign`, up to the highest power; beyond its travel the plant holds it."""
    p = of.params
    powers_n = [p.power_1_n, p.power_2_n, p.power_3_n]
    while powers_n and powers_n[-1] == 0.0:
        powers_n.pop()
    shape = float(len(powers_n)), p.centre_m, p.half_travel_m
    return [ModelTerm(of.effect, shape, tuple(sign * c for c in powers_n))] if powers_n else []
