"""Predicts the regression data of a planned motion: position with sensor noise, force of the rigid model."""

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.kinds import RegressionData
from reconcile.design.recorded_axis import RecordedAxis
from reconcile.recording.kinematics import kinematics
from reconcile.regression.regression_data import with_model_force
from reconcile.sensing.channel import noise, quantum


def predicted_data(
    position_m: Array, period_s: float, like: RegressionData, recorded: RecordedAxis
) -> RegressionData:
    """Return the data of commanded positions (n,), with noise and channels of the recording `like`."""
    n = len(position_m)
    step_m = quantum(like.motion.position_m)
    spread_m = noise(like.motion.position_m, step_m)
    sensed_m: Array = position_m + np.random.default_rng(0).normal(size=n) * spread_m
    if step_m > 0.0:
        sensed_m = np.round(sensed_m / step_m) * step_m
    motion = kinematics(sensed_m, period_s)
    force_n: Array = (
        recorded.mass_kg * motion.acceleration_m_s2 + recorded.viscous_n_s_m * motion.velocity_m_s
    )
    force_n = force_n + recorded.coulomb_n * motion.direction
    return with_model_force(
        RegressionData(
            period_s=period_s,
            time_s=np.arange(n, dtype=np.float64) * period_s,
            motion=motion,
            force_n=force_n,
            model_force_n=force_n,
            lead_m=like.lead_m,
            motor_mass_kg=like.motor_mass_kg,
            scale_m=None if like.scale_m is None else sensed_m,
            temperature_k=None if like.temperature_k is None else np.full(n, float(like.temperature_k[-1])),
            others={name: kinematics(np.zeros(n), period_s) for name in like.others},
        )
    )
