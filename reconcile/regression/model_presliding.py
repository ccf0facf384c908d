"""The presliding friction that a model already has (GMS or LuGre), along the recorded motion.

The kernels are those of hil_sim.physics, so that model and plant agree to the bit of the law.
"""

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from hil_sim.physics.friction import presliding_hysteresis, stribeck_friction
from hil_sim.physics.kinds import Kind
from hil_sim.physics.registry import of_kind
from hil_sim.plant.layout import state_record
from kernels.arrays import Array
from kernels.jit import uncached_kernel
from kernels.quantities import section_of
from reconcile.catalogue.conversion import ModelTerm
from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.formats.nominal_axis import ModelEffects, NominalAxis
from reconcile.nominal_model.model_terms import terms_of_model
from reconcile.recording.kinematics import Kinematics

SUBSTEPS = 8
"""Integration steps per sample, because bristles are stiff against a sample time."""
KERNELS = {section_of(module): module for module in of_kind(Kind.PRESLIDING)}
"""The laws that shape all of the friction level, by the effect's name."""


def presliding_n(given: ModelEffects, coulomb_n: float, motion: Kinematics, period_s: float) -> Array | None:
    """Presliding friction less the level times direction, N (n,): every model has that in its own columns.

    None where the model has no presliding law.
    """
    name = next((name for name in KERNELS if name in given.effects), None)
    if name is None:
        return None
    stribeck = given.effects.get(section_of(stribeck_friction), stribeck_friction.NEUTRAL)
    speeds_m_s = np.abs(motion.velocity_m_s)
    level_n = coulomb_n + np.array([stribeck_friction.level_n(stribeck, speed) for speed in speeds_m_s])
    state = state_record(KERNELS[name])
    force_n: Array = _run(name)(given.effects[name], state, motion.velocity_m_s, level_n, period_s)
    return force_n - level_n * motion.direction


def regressed_terms(
    axis: NominalAxis, datasets: Sequence[RegressionData], channel: ResidualChannel
) -> list[ModelTerm]:
    """The model's terms in a channel, but for those that a presliding law along the motion replaces."""
    by_law = not KERNELS.keys().isdisjoint(axis.model_effects.effects)
    return [
        one
        for one in terms_of_model(axis, datasets)
        if one.channel is channel and not (by_law and one.effect == section_of(presliding_hysteresis))
    ]


@cache
def _run(name: str) -> Any:
    """Loop of a law over a recording; compiled once for each law."""
    slide, force_and_damping = KERNELS[name].slide, KERNELS[name].force_and_damping

    @uncached_kernel  # a closure over the law: its cache entry would be mistaken for that of another
    def run(p: Any, s: Any, velocity_m_s: Array, level_n: Array, period_s: float) -> Array:
        force_n = np.zeros(len(velocity_m_s))
        dt_s = period_s / SUBSTEPS
        for i in range(1, len(velocity_m_s)):
            for k in range(SUBSTEPS):
                fraction = (k + 0.5) / SUBSTEPS
                v = velocity_m_s[i - 1] + fraction * (velocity_m_s[i] - velocity_m_s[i - 1])
                slide(p, s, v, level_n[i], dt_s)
            elastic_n, damping = force_and_damping(p, s, velocity_m_s[i], level_n[i])
            force_n[i] = elastic_n + damping * velocity_m_s[i]
        return force_n

    return run
