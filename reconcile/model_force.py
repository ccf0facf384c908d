"""The force of a fitted model, and by it the share of friction that holds the axis where it sticks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.scenes import holding, known_to_the_model
from reconcile.selection import TIMING
from reconcile.smooth_terms import PREFIX

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene
    from reconcile.scenes import Difference

    Array = NDArray[np.float64]

LEAST_N = 1e-6
LATE = (*TIMING, PREFIX + "moment_of_delay")
"""A delay is not in the force that it delays."""


def with_force_of(
    found: Difference, recording: int, slots: Sequence[tuple[int, int]], weights: Array
) -> Scene:
    """A scene with the model's force, and as direction the share of friction that makes it the measured one.

    `slots`, `weights`: the ledger's coefficients of the model, of columns as they were given. Where the axis
    moves the direction is its sign; where it sticks friction is what holds it, built-up presliding and all.
    """
    scene = found.scenes[recording]
    m = scene.motion
    own = [
        (column, weight) for (column, of), weight in zip(slots, weights, strict=True) if of in (-1, recording)
    ]

    def force_n(share: Array | float) -> Array:
        direction = np.where(m.moving, m.direction, share)
        return _force_n(found, scene._replace(motion=m._replace(direction=direction)), own)

    without_n = force_n(0.0)
    level_n = force_n(1.0) - without_n
    direction = holding(scene, without_n, np.where(level_n > LEAST_N, level_n, np.inf))
    # what grows with the cube of this force would grow beyond all bounds when it is seen through itself
    most_n = float(np.abs(scene.force_n).max())
    model_force_n = np.clip(force_n(direction) + scene.held_n, -most_n, most_n)
    return scene._replace(motion=m._replace(direction=direction), model_force_n=model_force_n)


def _force_n(found: Difference, scene: Scene, own: Sequence[tuple[int, float]]) -> Array:
    """Of the base's columns, of the plan's, and of what the model knew already; unfiltered."""
    m = scene.motion
    columns = [m.acceleration_m_s2, m.velocity_m_s, m.direction]
    for effect, shape, columns_of, width in found.plan:
        wanted = effect not in LATE and any(len(columns) <= place < len(columns) + width for place, _ in own)
        raw = columns_of(scene, shape) if wanted else np.zeros((1, width))
        columns += [raw[:, k] for k in range(width)]
    total_n = np.zeros(len(m.position_m))
    for place, weight in own:
        total_n = total_n + weight * columns[place]
    return total_n + known_to_the_model(scene, found.sense, found.known)
