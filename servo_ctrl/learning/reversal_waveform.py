"""Learned waveform compensation (LWC): the force that friction needs, known before the reversal comes (ours).

    f(t) = clip(F(t + L) + s w(t - t1; a)) + b v* + c a*

t1 is the reversal, s the new direction, a the reverse acceleration. F is a friction with memory on the
*commanded* motion, a sum of W_i D_i, where each D_i relaxes to the direction of motion over a slip
distance x_i: dD = (d - D)(1 - exp(-|dx| / x_i)) (Dahl 1968; a bank of them, as the Maxwell slip
elements of Al-Bender et al. 2005). b v* + c a* is what the feedforward of the loop misses: viscous
friction, and half a period in the sum of the velocity error (-ki T / 2). w is a free waveform that
repeated strokes have learned; L leads by the dead time of bus and amplifier. Learning law, between
strokes j of one reverse acceleration:

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
from servo_ctrl.learning.performance import Indices, reversals

SLIP_M = (2e-6, 8e-6, 30e-6, 100e-6)
"""Slip distances x_i; chosen: presliding of rolling guides and screws spans 1 to 100 um."""
AHEAD_S = 0.03
"""Before a reversal, from where the waveform acts; chosen: above ten dead times."""
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
    dead_samples: int
    """From a force set point to the force, whole periods."""


class FrictionMemory(NamedTuple):
    """Identified friction with memory."""

    level_n: tuple[float, ...]
    """W_i, one for each of `SLIP_M`."""
    per_speed_n_s_m: float
    """b, of either sign."""
    per_acceleration_kg: float
    """c, of either sign."""


class ReversalWaveforms(NamedTuple):
    """What was learned of one axis."""

    friction: FrictionMemory
    accelerations_m_s2: tuple[float, ...]
    """Rising; none = friction alone."""
    waveforms_n: tuple[Array, ...]
    """(n_i,) from AHEAD_S before a reversal on, at the period, for one into the positive direction."""
    limit_n: float
    """F + s w stays within +- this."""
    dead_samples: int


@kernel
def _relaxed(position_m: Array, slip_m: float) -> Array:
    memory = np.zeros(len(position_m))
    for k in range(1, len(position_m)):
        step_m = position_m[k] - position_m[k - 1]
        direction = 1.0 if step_m > 0.0 else -1.0
        memory[k] = memory[k - 1] + (direction - memory[k - 1]) * -math.expm1(-abs(step_m) / slip_m)
    return memory


def memories(position_m: Array) -> Array:
    """(n, elements): every D_i of a commanded motion."""
    return np.column_stack([_relaxed(position_m, slip_m) for slip_m in SLIP_M])


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


def identified(loop: LoopModel, strokes: list[tuple[Array, Array]]) -> FrictionMemory:
    """Friction from strokes without compensation: (commands (n, >= 3), error (n,)). No W_i is negative."""
    from scipy.optimize import lsq_linear  # noqa: PLC0415  # not wanted by who only applies waveforms

    rows = [np.column_stack([memories(commands[:, 0]), commands[:, 1:3]]) for commands, _ in strokes]
    wanted = [missing_force_n(loop, error_m) for _, error_m in strokes]
    lowest = [0.0] * len(SLIP_M) + [-np.inf] * 2
    weights = lsq_linear(np.concatenate(rows), np.concatenate(wanted), (lowest, np.inf)).x.tolist()
    return FrictionMemory(tuple(weights[:-2]), *weights[-2:])


def compensation_n(learned: ReversalWaveforms, commands: Array, period_s: float) -> Array:
    """F (n,) for the commands (n, >= 3) of one axis: position m, velocity m/s, acceleration m/s^2."""
    position_m, acceleration_m_s2 = commands[:, 0], commands[:, 2]
    early = np.minimum(np.arange(len(commands)) + learned.dead_samples, len(commands) - 1)
    force_n = (memories(position_m) @ np.array(learned.friction.level_n))[early]
    starts = reversals(position_m)
    ahead = round(AHEAD_S / period_s)
    for start, following in zip(starts, np.append(starts[1:], len(position_m) + ahead), strict=True):
        wave_n = waveform_at(learned, abs(float(acceleration_m_s2[start])), period_s)
        wave_n = wave_n[
            : max(int(following) - int(start), 0)
        ]  # the next reversal's begins where this one ends
        direction = np.sign(position_m[start] - position_m[start - 1])
        first, last = max(start - ahead, 0), min(start - ahead + len(wave_n), len(position_m))
        force_n[first:last] += direction * wave_n[first - (start - ahead) : last - (start - ahead)]
    motion_n = commands[:, 1:3] @ np.array(learned.friction[1:])
    return np.asarray(np.clip(force_n, -learned.limit_n, learned.limit_n) + motion_n)


def waveform_at(learned: ReversalWaveforms, reverse_m_s2: float, period_s: float) -> Array:
    """The w (n,) of a reverse acceleration: between neighbours at equal distance; held outside of them."""
    known = np.array(learned.accelerations_m_s2)
    if not len(known):
        return np.zeros(0)
    place = float(np.interp(math.log(max(reverse_m_s2, 1e-9)), np.log(known), np.arange(len(known))))
    lower, share = int(place), place - int(place)
    sides = [(lower, 1.0 - share), (min(lower + 1, len(known) - 1), share)]
    within_m_s2 = float(np.clip(reverse_m_s2, known[0], known[-1]))
    stretch = {i: math.sqrt(within_m_s2 / known[i]) for i, _ in sides}
    ahead = round(AHEAD_S / period_s)
    length = ahead + max(int((len(learned.waveforms_n[i]) - ahead) / stretch[i]) for i, _ in sides)
    since = np.arange(length) - ahead
    wave_n = np.zeros(length)
    for i, weight in sides:
        own = np.where(since > 0, since * stretch[i], since) + ahead
        wave = learned.waveforms_n[i]
        wave_n += weight * np.interp(own, np.arange(len(wave)), wave, right=0.0)
    return wave_n


def cut_out(values: Array, starts: Indices, directions: Array, length: int, period_s: float) -> Array:
    """Mean (length,) of what stands around the reversals, each turned into the positive direction."""
    ahead = round(AHEAD_S / period_s)
    whole = [(s, d) for s, d in zip(starts, directions, strict=True) if s - ahead + length <= len(values)]
    pieces = [direction * values[start - ahead : start - ahead + length] for start, direction in whole]
    return np.asarray(np.mean(pieces, axis=0))


def corrected(wave_n: Array, missing_n: Array, gain: float, loop: LoopModel) -> Array:
    """The next waveform (n,) from what was missing with this one: led, low-passed, tapered."""
    early_n = missing_n[np.minimum(np.arange(len(missing_n)) + loop.dead_samples, len(missing_n) - 1)]
    sigma = 1.0 / (2.0 * math.pi * FILTER_HZ * loop.period_s)
    changed = gaussian_filter1d(wave_n + gain * early_n, sigma, mode="nearest")
    rise = np.clip(np.arange(len(wave_n)) / (0.3 * AHEAD_S / loop.period_s), 0.0, 1.0)
    fall = np.clip(np.arange(len(wave_n))[::-1] / (TAPER * len(wave_n)), 0.0, 1.0)
    return np.asarray(changed * np.sin(0.5 * np.pi * rise) ** 2 * np.sin(0.5 * np.pi * fall) ** 2)


def contraction(loop: LoopModel, mass_share: float, gain: float, frequency_hz: Array) -> Array:
    """|Q (1 - g P / P_model)| (n,) for a mass of `mass_share` times the model's; below 1 it converges."""
    s = 2j * math.pi * frequency_hz
    rest = loop.kv_n_s_m * s + loop.kv_n_s_m * loop.kp_1_s + loop.ki_n_m + loop.ki_n_m * loop.kp_1_s / s
    ratio = (loop.mass_kg * s**2 + rest) / (mass_share * loop.mass_kg * s**2 + rest)
    low_pass = np.exp(-0.5 * (frequency_hz / FILTER_HZ) ** 2)
    return np.asarray(np.abs(low_pass * (1.0 - gain * low_pass * ratio)))
