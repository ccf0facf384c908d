"""An axis that is known to the newton, its recordings and what a diagnosis might say of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Scene, Sense
from reconcile.catalogue.registry import hypotheses
from reconcile.explain import Explanation, Level
from reconcile.findings import Finding, Rival
from reconcile.kinematics import kinematics
from reconcile.ledger import Candidate
from reconcile.model_file import NominalAxis
from reconcile.next_experiment_limits import Limits
from reconcile.next_experiment_pool import pool
from reconcile.rests import Rest
from reconcile.scenes import difference

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Shape

    Array = NDArray[np.float64]

T = 1e-3
MASS_KG, VISCOUS_N_S_M, COULOMB_N = 50.0, 100.0, 12.0
COUNT_M = 5e-9
NOISE_N = 0.3
REACH = Limits(-0.04, 0.04, 0.15, 1.5, 75.0, 0.0)
AXIS = NominalAxis(
    lead_m=5e-3,
    force_constant_n_a=500.0,
    mass_kg=MASS_KG,
    motor_mass_kg=0.0,
    viscous_n_s_m=VISCOUS_N_S_M,
    coulomb_n=COULOMB_N,
    encoder_resolution_m=COUNT_M,
    scale_resolution_m=None,
    pole_pairs=None,
    grating_m=None,
    bus=None,
)


def recording(kind: str) -> Array:
    """Positions (n,) of a motion: a sine of 30 mm at 0.5 Hz, or one of the pool by its kind."""
    if kind == "sine":
        return 0.03 * np.sin(np.pi * np.arange(12_000) * T)
    return next(one.position_m for one in pool(REACH, T, 1e-5, 1e-7) if one.motion.kind == kind)


def scene_over(position_m: Array, more: Sequence[Finding] = (), noise_n: float = 0.0) -> Scene:
    """Rigid, with the effects of findings whose `gain` is their coefficient."""
    motion = kinematics(np.round(position_m / COUNT_M) * COUNT_M, T)
    force_n = MASS_KG * motion.acceleration_m_s2 + VISCOUS_N_S_M * motion.velocity_m_s
    force_n = force_n + COULOMB_N * motion.direction
    scene = Scene(
        T, np.arange(len(position_m)) * T, motion, force_n, force_n, AXIS.lead_m, 0.0, None, None, {}
    )
    for one in more:
        columns = hypotheses(one.effect, Sense.FORCE)[0].columns(scene, one.candidates[0].shape)
        force_n = force_n + columns @ np.full(columns.shape[1], one.gain)
    force_n = force_n + np.random.default_rng(1).normal(size=len(force_n)) * noise_n
    return scene._replace(force_n=force_n)


def finding(
    effect: str,
    shape: Shape,
    coefficient: float,
    *,
    rivals: Sequence[tuple[str, float]] = (),
    equivalent: Sequence[str] = (),
) -> Finding:
    """As the engine names it."""
    return Finding(
        effect,
        "force",
        0.9,
        list(equivalent),
        [Rival(name, doubt, 0.9) for name, doubt in rivals],
        [Candidate(effect, shape, False, (0,))],
        {},
        coefficient,
        0.5,
        "",
    )


def made_up(positions: Sequence[Array], findings: Sequence[Finding], noise_n: float = NOISE_N) -> Explanation:
    """What a diagnosis of the force says that has found just that, and left the noise."""
    scenes = [scene_over(position_m, findings, noise_n) for position_m in positions]
    plain = difference(scenes, Sense.FORCE, [(f.effect, f.candidates[0].shape) for f in findings], only=True)
    rests = []
    for index, scene in enumerate(scenes):
        y, columns = plain.sides(index)
        used = plain.used[index]
        theta, *_ = np.linalg.lstsq(columns[used], y[used], rcond=None)
        left = y - columns @ theta
        rests.append(Rest("run.csv", scene, y, left, left, left, used, used))
    level = Level(noise_n, noise_n)
    base = {"mass_kg": MASS_KG, "viscous_n_s_m": VISCOUS_N_S_M, "coulomb_n": COULOMB_N}
    return Explanation(Sense.FORCE, list(findings), [], level, level, level, base, None, 0.0, False, rests)
