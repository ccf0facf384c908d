"""An axis with known parameters, its recordings, and the explanation that a diagnosis would find."""

from collections.abc import Sequence

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.kinds import RegressionData, ResidualChannel, ShapeParameters
from reconcile.catalogue.registry import ENTRIES
from reconcile.design.candidate_motions import candidate_motions
from reconcile.design.limits import AxisLimits
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.identification.explain import Explanation, ResidualRms
from reconcile.identification.findings import IdentifiedEffect
from reconcile.identification.rivals import RivalEffect
from reconcile.recording.kinematics import kinematics
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.regression_problem import regression_problem
from reconcile.regression.residual import Residual

T = 1e-3
MASS_KG, VISCOUS_N_S_M, COULOMB_N = 50.0, 100.0, 12.0
COUNT_M = 5e-9
NOISE_N = 0.3
LIMITS = AxisLimits(
    min_position_m=-0.04,
    max_position_m=0.04,
    velocity_m_s=0.15,
    acceleration_m_s2=1.5,
    jerk_m_s3=75.0,
    home_m=0.0,
)
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


def motion_m(kind: str) -> Array:
    """Positions (n,) of a sine of 30 mm at 0.5 Hz, or of the candidate motion of this kind."""
    if kind == "sine":
        return 0.03 * np.sin(np.pi * np.arange(12_000) * T)
    return next(one.position_m for one in candidate_motions(LIMITS, T, 1e-5, 1e-7) if one.motion.kind == kind)


def regression_data_of(
    position_m: Array, more: Sequence[IdentifiedEffect] = (), noise_n: float = 0.0
) -> RegressionData:
    """Regression data of a rigid axis with the effects `more`, whose `gain` is their coefficient."""
    motion = kinematics(np.round(position_m / COUNT_M) * COUNT_M, T)
    force_n = MASS_KG * motion.acceleration_m_s2 + VISCOUS_N_S_M * motion.velocity_m_s
    force_n = force_n + COULOMB_N * motion.direction
    data = RegressionData(
        period_s=T,
        time_s=np.arange(len(position_m)) * T,
        motion=motion,
        force_n=force_n,
        model_force_n=force_n,
        lead_m=AXIS.lead_m,
        motor_mass_kg=0.0,
        scale_m=None,
        temperature_k=None,
        others={},
    )
    for one in more:
        columns = ENTRIES[one.effect].terms[0].columns(data, one.candidates[0].shape_parameters)
        force_n = force_n + columns @ np.full(columns.shape[1], one.gain)
    force_n = force_n + np.random.default_rng(1).normal(size=len(force_n)) * noise_n
    return data._replace(force_n=force_n)


def identified_effect(
    effect: str,
    shape: ShapeParameters,
    coefficient: float,
    *,
    rivals: Sequence[tuple[str, float]] = (),
    equivalent: Sequence[str] = (),
) -> IdentifiedEffect:
    """An identified effect whose `gain` is its coefficient."""
    return IdentifiedEffect(
        effect=effect,
        channel="force",
        confidence=0.9,
        equivalent=list(equivalent),
        rivals=[RivalEffect(name, doubt, 0.9) for name, doubt in rivals],
        candidates=[CandidateTerm(effect, shape, False, (0,))],
        parameters={},
        gain=coefficient,
        heldout_gain=0.5,
        explanation="",
    )


def explanation_of(
    positions: Sequence[Array], findings: Sequence[IdentifiedEffect], noise_n: float = NOISE_N
) -> Explanation:
    """Explanation of the force by exactly these findings; the noise is the residual."""
    datasets = [regression_data_of(position_m, findings, noise_n) for position_m in positions]
    plain = regression_problem(
        datasets,
        ResidualChannel.FORCE,
        [(f.effect, f.candidates[0].shape_parameters) for f in findings],
        only=True,
    )
    residuals = []
    for index, data in enumerate(datasets):
        y, columns = plain.target_and_columns(index)
        used = plain.used[index]
        theta, *_ = np.linalg.lstsq(columns[used], y[used], rcond=None)
        left = y - columns @ theta
        residuals.append(Residual("run.csv", data, y, left, left, left, used, used))
    level = ResidualRms(noise_n, noise_n)
    base = {"mass_kg": MASS_KG, "viscous_n_s_m": VISCOUS_N_S_M, "coulomb_n": COULOMB_N}
    return Explanation(
        ResidualChannel.FORCE, list(findings), [], level, level, level, base, None, 0.0, False, residuals
    )
