"""A motion that was not made, as a recording would show it: positions as sensed, force as modelled."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Scene
from reconcile.kinematics import kinematics
from reconcile.scenes import with_model_force
from reconcile.sensing_channel import noise, quantum

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from reconcile.next_experiment_recorded import Recorded

    Array = NDArray[np.float64]


def scene_to_come(position_m: Array, period_s: float, like: Scene, seen: Recorded) -> Scene:
    """Of commanded positions (n,), one a `period_s`: with noise and channels of the recording `like`."""
    n = len(position_m)
    step_m = quantum(like.motion.position_m)
    spread_m = noise(like.motion.position_m, step_m)
    sensed_m: Array = position_m + np.random.default_rng(0).normal(size=n) * spread_m
    if step_m > 0.0:
        sensed_m = np.round(sensed_m / step_m) * step_m
    motion = kinematics(sensed_m, period_s)
    force_n: Array = seen.mass_kg * motion.acceleration_m_s2 + seen.viscous_n_s_m * motion.velocity_m_s
    force_n = force_n + seen.coulomb_n * motion.direction
    return with_model_force(
        Scene(
            period_s,
            np.arange(n, dtype=np.float64) * period_s,
            motion,
            force_n,
            force_n,
            like.lead_m,
            like.motor_mass_kg,
            None if like.scale_m is None else sensed_m,
            None if like.temperature_k is None else np.full(n, float(like.temperature_k[-1])),
            {name: kinematics(np.zeros(n), period_s) for name in like.others},
        )
    )
