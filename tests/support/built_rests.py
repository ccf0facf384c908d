"""Rests built by formula: an axis that moves, white noise, and an effect of choice behind the filter."""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Scene
from reconcile.kinematics import kinematics
from reconcile.rests import Rest
from reconcile.scenes import FILTER_HZ
from reconcile.state_filter import StateFilter

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

T, N, LEAD_M = 1e-3, 24_000, 5e-3
NOISE_N = 0.3
MASS_KG = 50.0


@functools.cache
def scene(seed: int = 0, *, temperature: bool = False) -> Scene:
    """Two sines of no common period, every five seconds a rest and a slow passage."""
    rng = np.random.default_rng(seed)
    t = np.arange(N) * T
    pace = np.where(t % 5.0 < 4.5, 1.0, 0.0) * np.where((t % 5.0 > 2.0) & (t % 5.0 < 2.5), 0.05, 1.0)
    phase = np.cumsum(np.convolve(pace, np.hanning(200) / np.hanning(200).sum(), mode="same")) * T
    x = 0.03 * np.sin(2.0 * math.pi * 0.23 * phase + rng.uniform(0.0, 1.0))
    x += 0.006 * np.sin(2.0 * math.pi * 0.97 * phase)
    motion = kinematics(np.round(x / 5e-9) * 5e-9, T)
    force = MASS_KG * motion.acceleration_m_s2 + 12.0 * motion.last_direction
    warm = 293.0 + 10.0 * (1.0 - np.exp(-t / 8.0)) if temperature else None
    return Scene(
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


def rest(
    effect: Callable[[Scene], Array] | None = None,
    *,
    of: Scene | None = None,
    seed: int = 0,
    noise: float = NOISE_N,
    source: str = "run.csv",
) -> Rest:
    """Before and refitted hold the effect and the noise, after the noise alone."""
    given = scene(seed) if of is None else of
    white = noise * np.random.default_rng(seed + 100).normal(size=N)
    low_pass = StateFilter(T, FILTER_HZ)
    after = low_pass(white)
    before = after if effect is None else low_pass(white + effect(given))
    used = ~given.motion.resting
    used[: low_pass.settled] = False
    held_out = np.arange(N) >= 3 * N // 4
    return Rest(source, given, before, before, before, after, used, held_out)
