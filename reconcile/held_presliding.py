"""Presliding that the model holds, by hil_sim's own kernels along the motion that was recorded."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numba
import numpy as np

from hil_sim.physics.friction import presliding_gms, presliding_lugre, stribeck_friction

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from reconcile.kinematics import Kinematics
    from reconcile.model_effects_held import Held

    Array = NDArray[np.float64]

SUBSTEPS = 8
"""Of a sample: the bristles are stiff."""
STATE = np.dtype(
    [
        ("element_n", (np.float64, (presliding_gms.ELEMENTS,))),
        ("slipping", (np.int64, (presliding_gms.ELEMENTS,))),
        ("slip_direction", np.float64),
        ("bristle_m", np.float64),
    ]
)
KERNELS = {"presliding_gms": presliding_gms, "presliding_lugre": presliding_lugre}


def beyond_sharp_n(held: Held, coulomb_n: float, motion: Kinematics, period_s: float) -> Array | None:
    """Friction (n,) less its level in the direction of motion, as every model has it; None: no such law."""
    name = next((name for name in KERNELS if name in held.effects), None)
    if name is None:
        return None
    rise = held.effects.get("stribeck_friction", stribeck_friction.NEUTRAL)
    speeds_m_s = np.abs(motion.velocity_m_s)
    level_n = coulomb_n + np.array([stribeck_friction.level_n(rise, speed) for speed in speeds_m_s])
    force_n: Array = _run(name)(
        held.effects[name], np.zeros(1, STATE)[0], motion.velocity_m_s, level_n, period_s
    )
    return force_n - level_n * motion.direction


@cache
def _run(name: str) -> Any:
    """A law's loop over a recording; compiled once, not for every recording."""
    slide, force_and_damping = KERNELS[name].slide, KERNELS[name].force_and_damping

    @numba.njit
    def run(p: Any, s: Any, velocity_m_s: Array, level_n: Array, period_s: float) -> Array:
        force_n = np.zeros(len(velocity_m_s))
        dt_s = period_s / SUBSTEPS
        for i in range(1, len(velocity_m_s)):
            for k in range(SUBSTEPS):
                share = (k + 0.5) / SUBSTEPS
                v = velocity_m_s[i - 1] + share * (velocity_m_s[i] - velocity_m_s[i - 1])
                slide(p, s, v, level_n[i], dt_s)
            elastic_n, damping = force_and_damping(p, s, velocity_m_s[i], level_n[i])
            force_n[i] = elastic_n + damping * velocity_m_s[i]
        return force_n

    return run
