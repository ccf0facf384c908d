"""Iterative learning of the waveform (`control.compensation.learned_waveform`), and its convergence.

Learning law from stroke j to j + 1 at one reverse acceleration:

    w_j+1 = Q (w_j + g P^-1 e_j),    P^-1 e = M e'' + kv e' + (kv kp + ki) e + ki kp int e

P is the response of the error to a force in the control loop, Q a Gaussian low pass with zero phase.
The error shrinks from stroke to stroke if |Q (1 - g P / P_model)| < 1 at every frequency (Norrlof and
Gunnarsson 2002, for monotone convergence of the filtered law); tests/unit/studies/test_waveform_learning.py
proves this for half to twice the mass.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array, compiled_layout
from kernels.jit import kernel
from servo_ctrl.learning.level_over_temperature import LevelSchedule
from servo_ctrl.learning.performance import Indices

SPAN_S = 0.45
"""Duration of a waveform after the reversal; chosen: more than twice Tm."""
TAPER_SHARE = 0.3
"""Share of a waveform, at its end, over which it fades to zero; chosen."""
TRUNCATION_DEVIATIONS = 4.0
"""Standard deviations at which the Gaussian of Q is cut off; its weight there is 0.0003 of the largest."""
SLOPES = 3
"""Slopes of the identified friction over the motion: speed, acceleration, jerk; they follow the levels."""
SLIDING_STATE_MIN = 0.98
"""Least |D_i| of each element in sliding; chosen: 4.6 slip distances after a reversal."""
FILTER_HZ = 80.0
"""Frequency at which Q is 0.61; of 40, 80 and 120 Hz the one of least J over the learning strokes."""


class LoopModel(NamedTuple):
    """Model of the control loop, from the machine file."""

    mass_kg: float
    kp_1_s: float
    kv_n_s_m: float
    ki_n_m: float
    period_s: float
    lead_s: float
    """Dead time from a force set point to the force."""
    slip_m: tuple[float, ...]
    """Slip distances of presliding, as in the control law."""
    ahead_s: float
    """Time before a reversal at which the waveform of the control law begins."""
    rest_span_m: float
    """Travel behind a rest over which the control law has a force."""

    @property
    def dead_samples(self) -> int:
        """The dead time in whole periods."""
        return round(self.lead_s / self.period_s)


class RestForce(NamedTuple):
    """What a rest adds to friction, in the direction of motion, at the travels of `control.rest_memory`."""

    rest_s: float
    onward_n: tuple[float, ...]
    """For a start in the direction of the motion before the rest."""
    turned_n: tuple[float, ...]
    """For one against it."""


class WaveformLearned(NamedTuple):
    """The learned friction and waveforms of one axis."""

    learner: str
    friction: tuple[float, ...]
    """Level of each slip distance, N; force per speed, N s/m; per acceleration, kg; per jerk, kg s."""
    accelerations_m_s2: tuple[float, ...]
    """Rising; empty: friction alone."""
    waves_n: tuple[tuple[float, ...], ...]
    """One value per period, from `ahead_s` before a reversal into the positive direction on."""
    before_m: float = math.nan
    """J without compensation, mean over the checked accelerations."""
    after_m: float = math.nan
    """J with friction and waveforms, likewise."""
    strokes: int = 0
    machine_time_s: float = 0.0
    rests: tuple[RestForce, ...] = ()
    """Rising durations."""
    schedule: LevelSchedule = LevelSchedule()
    """Level of friction over temperature, relative to this waveform; production learns it."""


def wave_table(accelerations_m_s2: tuple[float, ...], waves_n: tuple[tuple[float, ...], ...]) -> Array:
    """The table of the control law, (m, 1 + n); zeros (1, 2) without a waveform."""
    if not accelerations_m_s2:
        return np.zeros((1, 2))
    return np.column_stack([np.array(accelerations_m_s2), np.array(waves_n)])


def rest_travels_m(loop: LoopModel, nodes: int) -> Array:
    """Travels behind a rest, (nodes,), at which the control law has forces."""
    return np.asarray(loop.rest_span_m * (np.arange(1, nodes + 1) / nodes) ** 3)


def samples_of(loop: LoopModel) -> int:
    """Number of samples of a waveform."""
    return round((loop.ahead_s + SPAN_S) / loop.period_s)


@kernel
def _relaxed(position_m: Array, slip_m: float) -> Array:
    memory = np.zeros(len(position_m))
    for k in range(1, len(position_m)):
        step_m = position_m[k] - position_m[k - 1]
        direction = 1.0 if step_m > 0.0 else -1.0
        memory[k] = memory[k - 1] + (direction - memory[k - 1]) * -math.expm1(-abs(step_m) / slip_m)
    return memory


def presliding_states(loop: LoopModel, position_m: Array) -> Array:
    """States D_i of presliding along a commanded motion, (n, elements); 0 before it."""
    path_m = compiled_layout(position_m)
    return np.column_stack([_relaxed(path_m, slip_m) for slip_m in loop.slip_m])


def missing_force_n(loop: LoopModel, error_m: Array, filter_hz: float = FILTER_HZ) -> Array:
    """P^-1 e, zero-phase low-passed: the force (n,) that would have left no error, from rest."""
    smooth_m = _low_passed(error_m, loop.period_s, filter_hz)
    speed_m_s = np.gradient(smooth_m, loop.period_s)
    integral_m_s = np.cumsum(smooth_m) * loop.period_s
    return (
        loop.mass_kg * np.gradient(speed_m_s, loop.period_s)
        + loop.kv_n_s_m * speed_m_s
        + (loop.kv_n_s_m * loop.kp_1_s + loop.ki_n_m) * smooth_m
        + loop.ki_n_m * loop.kp_1_s * integral_m_s
    )


def identify_friction(loop: LoopModel, strokes: list[tuple[Array, Array]]) -> tuple[float, ...]:
    """Identify friction from strokes without compensation: commands (n, >= 3) and error (n,) of each.

    Least squares with a constant for each stroke, the unknown initial value of the integrator. First the
    slopes over speed, acceleration and jerk, only from samples in which all elements slide, because errors of
    the D_i at the reversals would bias them. Then W_i >= 0. Returns the fields of `WaveformLearned.friction`.
    """
    from scipy.optimize import lsq_linear  # noqa: PLC0415  # loaded only where waveforms are learned

    states = np.concatenate([presliding_states(loop, commands[:, 0]) for commands, _ in strokes])
    motion = np.concatenate(
        [
            np.column_stack([commands[:, 1:3], np.gradient(commands[:, 2], loop.period_s)])
            for commands, _ in strokes
        ]
    )
    constants = np.repeat(np.eye(len(strokes)), [len(error_m) for _, error_m in strokes], axis=0)
    targets_n = np.concatenate([missing_force_n(loop, error_m) for _, error_m in strokes])
    sliding = np.abs(states).min(axis=1) > SLIDING_STATE_MIN
    level = states.mean(axis=1, keepdims=True)
    slopes = np.linalg.lstsq(np.hstack([motion, level, constants])[sliding], targets_n[sliding])[0][:SLOPES]
    lowest = [0.0] * len(loop.slip_m) + [-np.inf] * len(strokes)
    level_targets_n = targets_n - motion @ slopes
    weights = lsq_linear(np.hstack([states, constants]), level_targets_n, (lowest, np.inf)).x.tolist()
    return (*weights[: len(loop.slip_m)], *slopes.tolist())


def mean_around_reversals(
    values: Array, starts: Indices, directions: Array, length: int, ahead: int
) -> Array:
    """Mean (length,) of the values from `ahead` samples before each reversal, turned into + direction."""
    complete = [(s, d) for s, d in zip(starts, directions, strict=True) if s - ahead + length <= len(values)]
    pieces = [direction * values[start - ahead : start - ahead + length] for start, direction in complete]
    return np.asarray(np.mean(pieces, axis=0))


def corrected(wave_n: Array, missing_n: Array, gain: float, loop: LoopModel) -> Array:
    """The next waveform (n,) from the missing force (n,): advanced by the dead time, low-passed, tapered."""
    advanced_n = missing_n[np.minimum(np.arange(len(missing_n)) + loop.dead_samples, len(missing_n) - 1)]
    changed = _low_passed(wave_n + gain * advanced_n, loop.period_s, FILTER_HZ)
    return np.asarray(changed * _taper(len(wave_n), loop))


def _low_passed(values: Array, period_s: float, filter_hz: float) -> Array:
    """Q: a Gaussian low pass (n,) with zero phase, 0.61 at `filter_hz`; the ends are held constant.

    The bits are those of `scipy.ndimage.gaussian_filter1d`. Loading that would take each start of a
    controller 0.3 s, and a running one would stall when production first asks for a correction.
    """
    deviation = 1.0 / (2.0 * math.pi * filter_hz * period_s)
    radius = int(TRUNCATION_DEVIATIONS * deviation + 0.5)
    weights = np.exp(-0.5 / deviation**2 * np.arange(-radius, radius + 1) ** 2)
    weights /= weights.sum()
    padded = np.pad(values, radius, mode="edge")
    samples = len(values)
    smooth: Array = weights[radius] * padded[radius : radius + samples]
    for i in range(radius):  # from the outside in, as the two values at one distance have one weight
        smooth += (padded[i : i + samples] + padded[2 * radius - i :][:samples]) * weights[i]
    return smooth


def _taper(samples: int, loop: LoopModel) -> Array:
    rise = np.clip(np.arange(samples) / (0.3 * loop.ahead_s / loop.period_s), 0.0, 1.0)
    fall = np.clip(np.arange(samples)[::-1] / (TAPER_SHARE * samples), 0.0, 1.0)
    return np.asarray(np.sin(0.5 * np.pi * rise) ** 2 * np.sin(0.5 * np.pi * fall) ** 2)
