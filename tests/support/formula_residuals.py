"""An axis by formula, its force with white noise and a chosen effect: residuals and regression problem."""

import functools
import math
from collections.abc import Callable, Sequence

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.kinds import RegressionData, ResidualChannel, ShapeParameters
from reconcile.recording.kinematics import kinematics
from reconcile.regression.filter_ends import FILTER_HZ
from reconcile.regression.regression_problem import RegressionProblem, regression_problem
from reconcile.regression.residual import Residual
from reconcile.regression.state_filter import StateFilter

T, N, LEAD_M = 1e-3, 24_000, 5e-3
NOISE_N = 0.3
MASS_KG, COULOMB_N = 50.0, 12.0


@functools.cache
def data(seed: int = 0, *, temperature: bool = False) -> RegressionData:
    """Return the motion of two incommensurate sines, with standstill and slow motion every five seconds."""
    rng = np.random.default_rng(seed)
    t = np.arange(N) * T
    pace = np.where(t % 5.0 < 4.5, 1.0, 0.0) * np.where((t % 5.0 > 2.0) & (t % 5.0 < 2.5), 0.05, 1.0)
    phase = np.cumsum(np.convolve(pace, np.hanning(200) / np.hanning(200).sum(), mode="same")) * T
    x = 0.03 * np.sin(2.0 * math.pi * 0.23 * phase + rng.uniform(0.0, 1.0))
    x += 0.006 * np.sin(2.0 * math.pi * 0.97 * phase)
    motion = kinematics(np.round(x / 5e-9) * 5e-9, T)
    force = MASS_KG * motion.acceleration_m_s2 + COULOMB_N * motion.last_direction
    warm = 293.0 + 10.0 * (1.0 - np.exp(-t / 8.0)) if temperature else None
    return RegressionData(
        period_s=T,
        time_s=t,
        motion=motion,
        force_n=force,
        model_force_n=force,
        lead_m=LEAD_M,
        motor_mass_kg=0.0,
        scale_m=None,
        temperature_k=warm,
        others={},
    )


def residual(
    effect: Callable[[RegressionData], Array] | None = None,
    *,
    of: RegressionData | None = None,
    seed: int = 0,
    noise: float = NOISE_N,
    source: str = "run.csv",
) -> Residual:
    """Return a residual: `before` and `refitted` with effect and noise, `after` with noise only."""
    given = data(seed) if of is None else of
    white = noise * np.random.default_rng(seed + 100).normal(size=N)
    low_pass = StateFilter(T, FILTER_HZ)
    after = low_pass(white)
    before = after if effect is None else low_pass(white + effect(given))
    used = ~given.motion.standing_still
    used[: low_pass.settled] = False
    held_out = np.arange(N) >= 3 * N // 4
    return Residual(
        source=source,
        data=given,
        measured=before,
        before=before,
        refitted=before,
        after=after,
        used=used,
        held_out=held_out,
    )


def problem(
    effect: Callable[[RegressionData], Array],
    terms: Sequence[tuple[str, ShapeParameters]],
    *,
    noise: float = NOISE_N,
    recordings: int = 1,
) -> RegressionProblem:
    """Return the regression of a force of mass, Coulomb friction, effect and noise on these terms only.

    The recordings differ in their noise.
    """
    given, rng = data(), np.random.default_rng(7)
    measured = [
        given._replace(force_n=given.force_n + effect(given) + noise * rng.normal(size=N))
        for _ in range(recordings)
    ]
    return regression_problem(measured, ResidualChannel.FORCE, terms, only=True)
