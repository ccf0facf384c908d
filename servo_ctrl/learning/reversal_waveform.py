"""How the waveform compensation (`control.compensation.learned_waveform`) is learned, and how it converges.

Learning law, between strokes j of one reverse acceleration:

    w_j+1 = Q (w_j + g P^-1 e_j),    P^-1 e = M e'' + kv e' + (kv kp + ki) e + ki kp int e

P is the response of the error to a force in the controller's own loop, Q a Gaussian low pass without phase.
The error shrinks from stroke to stroke where |Q (1 - g P / P_model)| < 1 at every frequency (Norrlof and
Gunnarsson 2002, for monotone convergence of the filtered law); `contraction` says how far.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from kernels.arrays import Array
from kernels.jit import kernel
from servo_ctrl.learning.performance import Indices

SPAN_S = 0.45
"""Of a waveform behind the reversal; chosen: beyond twice Tm."""
TAPER = 0.3
"""Share at the end of a waveform in which it goes to zero; chosen."""
FILTER_HZ = 80.0
"""Q is 0.61 there; of 40, 80 and 120 Hz the one with the least J over the learning strokes."""


class LoopModel(NamedTuple):
    """What the controller knows of its own loop."""

    mass_kg: float
    kp_1_s: float
    kv_n_s_m: float
    ki_n_m: float
    period_s: float
    lead_s: float
    """From a force set point to the force."""
    slip_m: tuple[float, ...]
    """Slip distances of the friction with memory, as the law has them."""
    ahead_s: float
    """Before a reversal, from where the law's waveform acts."""

    @property
    def dead_samples(self) -> int:
        """The lead in whole periods."""
        return round(self.lead_s / self.period_s)


class WaveformLearned(NamedTuple):
    """What was learned of one axis."""

    learner: str
    friction: tuple[float, ...]
    """Level of each slip distance, N; force per speed, N s/m; force per acceleration, kg."""
    accelerations_m_s2: tuple[float, ...]
    """Rising; none = friction alone."""
    waves_n: tuple[tuple[float, ...], ...]
    """Each period, from `ahead_s` before a reversal into the positive direction on."""
    before_m: float = math.nan
    """J without compensation, mean over the checked accelerations."""
    after_m: float = math.nan
    """J with what was learned, likewise."""
    strokes: int = 0
    machine_time_s: float = 0.0


def wave_table(accelerations_m_s2: tuple[float, ...], waves_n: tuple[tuple[float, ...], ...]) -> Array:
    """(m, 1 + n): the table of the control law; without a waveform one of zeros."""
    if not accelerations_m_s2:
        return np.zeros((1, 2))
    return np.column_stack([np.array(accelerations_m_s2), np.array(waves_n)])


def samples_of(loop: LoopModel) -> int:
    """Samples of a waveform."""
    return round((loop.ahead_s + SPAN_S) / loop.period_s)


@kernel
def _relaxed(position_m: Array, slip_m: float) -> Array:
    memory = np.zeros(len(position_m))
    for k in range(1, len(position_m)):
        step_m = position_m[k] - position_m[k - 1]
        direction = 1.0 if step_m > 0.0 else -1.0
        memory[k] = memory[k - 1] + (direction - memory[k - 1]) * -math.expm1(-abs(step_m) / slip_m)
    return memory


def memories(loop: LoopModel, position_m: Array) -> Array:
    """(n, elements): every D_i of a commanded motion, at rest before it."""
    return np.column_stack([_relaxed(position_m, slip_m) for slip_m in loop.slip_m])


def missing_force_n(loop: LoopModel, error_m: Array, filter_hz: float = FILTER_HZ) -> Array:
    """P^-1 e, low-passed without phase: the force (n,) that would have left no error. Starts at rest."""
    sigma = 1.0 / (2.0 * math.pi * filter_hz * loop.period_s)
    smooth_m = gaussian_filter1d(error_m, sigma, mode="nearest")
    speed_m_s = np.gradient(smooth_m, loop.period_s)
    integral_m_s = np.cumsum(smooth_m) * loop.period_s
    return (
        loop.mass_kg * np.gradient(speed_m_s, loop.period_s)
        + loop.kv_n_s_m * speed_m_s
        + (loop.kv_n_s_m * loop.kp_1_s + loop.ki_n_m) * smooth_m
        + loop.ki_n_m * loop.kp_1_s * integral_m_s
    )


def identified(loop: LoopModel, strokes: list[tuple[Array, Array]]) -> tuple[float, ...]:
    """Friction from strokes without compensation: (commands (n, >= 3), error (n,)). No W_i is negative.

    What the integrator holds at the beginning of a stroke is unknown: a constant for each.
    """
    from scipy.optimize import lsq_linear  # noqa: PLC0415  # not wanted by who only applies waveforms

    rows = [np.column_stack([memories(loop, commands[:, 0]), commands[:, 1:3]]) for commands, _ in strokes]
    wanted = [missing_force_n(loop, error_m) for _, error_m in strokes]
    held = [
        np.repeat(np.eye(len(strokes))[[place]], len(entry), axis=0) for place, entry in enumerate(wanted)
    ]
    matrix = np.hstack([np.concatenate(rows), np.concatenate(held)])
    lowest = [0.0] * len(loop.slip_m) + [-np.inf] * (2 + len(strokes))
    weights = lsq_linear(matrix, np.concatenate(wanted), (lowest, np.inf)).x.tolist()
    return tuple(weights[: len(loop.slip_m) + 2])


def cut_out(values: Array, starts: Indices, directions: Array, length: int, ahead: int) -> Array:
    """Mean (length,) of what stands around the reversals, each turned into the positive direction."""
    whole = [(s, d) for s, d in zip(starts, directions, strict=True) if s - ahead + length <= len(values)]
    pieces = [direction * values[start - ahead : start - ahead + length] for start, direction in whole]
    return np.asarray(np.mean(pieces, axis=0))


def corrected(wave_n: Array, missing_n: Array, gain: float, loop: LoopModel) -> Array:
    """The next waveform (n,) from what was missing with this one: led, low-passed, tapered."""
    early_n = missing_n[np.minimum(np.arange(len(missing_n)) + loop.dead_samples, len(missing_n) - 1)]
    sigma = 1.0 / (2.0 * math.pi * FILTER_HZ * loop.period_s)
    changed = gaussian_filter1d(wave_n + gain * early_n, sigma, mode="nearest")
    return np.asarray(changed * _taper(len(wave_n), loop))


def _taper(samples: int, loop: LoopModel) -> Array:
    rise = np.clip(np.arange(samples) / (0.3 * loop.ahead_s / loop.period_s), 0.0, 1.0)
    fall = np.clip(np.arange(samples)[::-1] / (TAPER * samples), 0.0, 1.0)
    return np.asarray(np.sin(0.5 * np.pi * rise) ** 2 * np.sin(0.5 * np.pi * fall) ** 2)


def contraction(loop: LoopModel, mass_share: float, gain: float, frequency_hz: Array) -> Array:
    """|Q (1 - g P / P_model)| (n,) for a mass of `mass_share` times the model's; below 1 it converges."""
    s = 2j * math.pi * frequency_hz
    rest = loop.kv_n_s_m * s + loop.kv_n_s_m * loop.kp_1_s + loop.ki_n_m + loop.ki_n_m * loop.kp_1_s / s
    ratio = (loop.mass_kg * s**2 + rest) / (mass_share * loop.mass_kg * s**2 + rest)
    low_pass = np.exp(-0.5 * (frequency_hz / FILTER_HZ) ** 2)
    return np.asarray(np.abs(low_pass * (1.0 - gain * low_pass * ratio)))
