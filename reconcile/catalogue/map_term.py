"""The map: an unnamed force over position and velocity together, for what no curve over either carries.

The columns are products of cosines over the knots of each coordinate, bilinear between knots. An even ridge
on the coefficients of damped cosines is a penalty on roughness, because cosines are the eigenvectors of the
difference of neighbouring knots. Source: Eilers and Marx (1996), P-splines; Strang (1999), the discrete
cosine transform.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.fft import dct

from hil_sim.physics.load import force_map
from kernels.arrays import Array
from kernels.quantities import section_of
from reconcile.catalogue.conversion import ModelEffect, ModelTerm, PlantValues
from reconcile.catalogue.kinds import RegressionData, ShapeParameters, SiParameter, UnnamedTerm
from reconcile.catalogue.table_of_knots import WITH_MEAN, place_in_knots

MAP = "position_and_velocity"
"""Its coordinates, as the name of the term."""
POSITIONS, VELOCITIES = 9, 7
"""Knots along each coordinate; an odd number of velocities has one at standstill. Chosen."""
MAP_COLUMNS = POSITIONS * VELOCITIES - 1
SMOOTHNESS = (0.0, 0.01, 0.03, 0.1, 0.3)
"""Damping of a cosine with the square of its half waves over the range, to choose from on folds: from a
grid of independent knots to little more than a plane."""


def _cosines(count: int) -> Array:
    """Cosines (knots, waves) of evenly spaced knots, orthonormal."""
    found: Array = dct(np.eye(count), norm="ortho", axis=0).T
    return found


def _damping(shape: ShapeParameters) -> Array:
    """Factor (positions, velocities) on the product of two cosines."""
    along, across = np.arange(shape[2]), np.arange(shape[5])
    factor: Array = 1.0 / (1.0 + shape[6] * (along[:, None] ** 2 + across**2))
    return factor


def column_scales(shape: ShapeParameters) -> Array:
    """Return the factors (k,) of its smoothness on the columns of a map without a mean."""
    return _damping(shape).ravel()[1:]


def _interpolation(values: Array, low: float, high: float, count: int) -> Array:
    """Share (n, knots) of each knot in a value between two of them; the ends beyond."""
    place = place_in_knots(values, low, high, count)
    share: Array = np.maximum(1.0 - np.abs(place[:, None] - np.arange(count)), 0.0)
    return share


def columns(data: RegressionData, shape: ShapeParameters) -> Array:
    """Return the products of cosines over position and velocity (n, k).

    Shape parameters: first and last position (m) and their number, the same of the velocity (m/s), and the
    smoothness. Without an eighth, WITH_MEAN, the mean over the knots is omitted: constant_force has it.
    """
    first_m, last_m, positions, first_m_s, last_m_s, velocities = shape[:6]
    motion = data.motion
    along = _interpolation(motion.position_m, first_m, last_m, int(positions)) @ _cosines(int(positions))
    across = _interpolation(motion.velocity_m_s, first_m_s, last_m_s, int(velocities))
    found: Array = along[:, :, None] * (across @ _cosines(int(velocities)))[:, None]
    found *= _damping(shape)
    found = found.reshape(len(along), -1)
    return found if WITH_MEAN in shape[7:] else found[:, 1:]


def _heights(shape: ShapeParameters, coefficients: Array) -> Array:
    """Heights (positions, velocities) of the knots, N that the motor needs."""
    waves = coefficients if WITH_MEAN in shape[7:] else np.append(0.0, coefficients)
    waves = waves.reshape(int(shape[2]), int(shape[5])) * _damping(shape)
    heights: Array = _cosines(int(shape[2])) @ waves @ _cosines(int(shape[5])).T
    return heights


def shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    """Return the map over the range of all recordings, by rising smoothness; the velocities are symmetric."""
    positions_m = np.concatenate([data.motion.position_m for data in datasets])
    speeds_m_s = np.concatenate([np.abs(data.motion.velocity_m_s) for data in datasets])
    low_m, high_m = (float(v) for v in np.percentile(positions_m, [1.0, 99.0]))
    fast_m_s = float(np.percentile(speeds_m_s, 98.0))
    grid = (low_m, high_m, float(POSITIONS), -fast_m_s, fast_m_s, float(VELOCITIES))
    return [(*grid, smoothness) for smoothness in SMOOTHNESS] if fast_m_s > 0.0 and high_m > low_m else []


def _parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, SiParameter]:
    """Knots of both coordinates and the heights above their mean, SI."""
    low_m, high_m, positions, low_m_s, high_m_s, velocities = shape[:6]
    found = {}
    for number, place in enumerate(np.linspace(low_m, high_m, int(positions)), 1):
        found[f"at_{number}"] = SiParameter(float(place), "m")
    for number, place in enumerate(np.linspace(low_m_s, high_m_s, int(velocities)), 1):
        found[f"at_velocity_{number}"] = SiParameter(float(place), "m/s")
    for (row, column), height in np.ndenumerate(_heights(shape, coefficients)):
        found[f"height_{row + 1}_{column + 1}"] = SiParameter(float(height), "")
    return found


def grid_of(p: Mapping[str, float]) -> tuple[list[float], list[float], Array]:
    """Return positions (m), velocities (m/s) and heights (positions, velocities) of the term's parameters."""
    velocities = [value for key, value in p.items() if key.startswith("at_velocity_")]
    positions = [v for key, v in p.items() if key.startswith("at_") and not key.startswith("at_velocity_")]
    heights = [value for key, value in p.items() if key.startswith("height_")]
    return positions, velocities, np.reshape(heights, (len(positions), len(velocities)))


def _finding(p: dict[str, float]) -> str:
    positions_m, velocities_m_s, heights = grid_of(p)
    row, column = np.unravel_index(np.abs(heights).argmax(), heights.shape)
    return (
        f"it changes with position and velocity together, most at {positions_m[row]:.4g} m and "
        f"{velocities_m_s[column]:.4g} m/s, and spans {np.ptp(heights):.3g} (SI)"
    )


def _to_plant(p: Mapping[str, float]) -> PlantValues:
    positions_m, velocities_m_s, heights = grid_of(p)
    return {
        "first_m": positions_m[0],
        "last_m": positions_m[-1],
        "positions": float(len(positions_m)),
        "first_m_s": velocities_m_s[0],
        "last_m_s": velocities_m_s[-1],
        "velocities": float(len(velocities_m_s)),
        "force_n": (-heights.T).ravel().tolist(),  # on the table: the motor needs the opposite
    }


def terms_of_map(of: ModelEffect, effect: str) -> list[ModelTerm]:
    """Return the term named `effect` that equals a plant's map; none for a map of zeros."""
    p = of.params
    positions, velocities = int(p.positions), int(p.velocities)
    heights = -np.reshape(p.force_n[: positions * velocities], (velocities, positions)).T
    waves = _cosines(positions).T @ heights @ _cosines(velocities)
    grid = (p.first_m, p.last_m, p.positions, p.first_m_s, p.last_m_s, p.velocities)
    term = ModelTerm(effect, (*grid, 0.0, WITH_MEAN), tuple(waves.ravel().tolist()))
    return [term] if np.any(heights) else []


MAP_TERM = UnnamedTerm(
    shapes, columns, _parameters, _finding, section=section_of(force_map), to_plant=_to_plant
)
