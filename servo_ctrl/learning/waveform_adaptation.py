"""Adapts the learned waveform from production reversals, without strokes.

The error trace e of one reversal over Tm gives the missing force m = P^-1 e. Its component along the
presliding force, sum W_i 2 (1 - exp(-x / x_i)), is a relative change of friction, which scales levels and
waveforms. The remaining force corrects the waveforms of the neighbouring accelerations, each by its share of
the interpolation, stretched to its own time.

A change that did not help is undone: `undo_if_worse` compares the next reversal at a similar acceleration.
The gain is then halved, unless J has jumped: that is a change of friction, not of the waveform.

With a temperature, each measured level also goes into a table over it (`level_over_temperature`), which moves
the level between reversals.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.learning.level_over_temperature import LevelSchedule, followed, learned_at
from servo_ctrl.learning.reversal_waveform import (
    FILTER_HZ,
    LoopModel,
    WaveformLearned,
    corrected,
    missing_force_n,
)
from servo_ctrl.learning.waveform_level import at_level, scaled

GAIN = 0.7
"""Gain of a correction by one reversal; the same as between strokes."""
LEVEL_DEAD_BAND = 0.05
"""Smallest relative change of friction that is applied; chosen: noise and position change it as much. With
a temperature there is none: warming is slower, and what waveforms take of it they keep in the cold."""
LEVEL_RANGE = (0.2, 5.0)
"""Bounds of friction relative to the strokes' result; chosen."""
SIMILAR_RATIO = 1.25
"""Ratio of reverse accelerations up to which two reversals are compared; chosen."""
WORSE_RATIO, WORSE_OFFSET_M = 1.15, 0.05e-6
"""A change is undone where J exceeds this factor times J before, plus this; chosen: scatter of reversals."""
UNCHANGED_BELOW_M = 0.1e-6
"""J below which nothing is changed; chosen: the resolution of the scale."""
JUMP_RATIO = 3.0
"""Growth of J between similar reversals that no correction can cause; chosen."""
GAIN_MIN = 0.05
"""Lower bound of the gain; chosen."""
PATIENCE = 4
"""Reversals at other accelerations during which a correction waits for its review; chosen."""


class ProductionReversal(NamedTuple):
    """A reversal in production."""

    acceleration_m_s2: float
    trace_m: Array
    """(n,): error after it, positive where the axis lags behind its new direction."""
    error_m: float
    """J."""
    temperature_degc: float = math.nan
    """NaN: there is none, or it is not to be trusted."""


class AdaptationState(NamedTuple):
    """State of the adaptation of one axis."""

    learned: WaveformLearned
    """Waveform in use."""
    level: float = 1.0
    """Friction relative to the strokes' result."""
    before: WaveformLearned | None = None
    """Waveform before the last correction, until that is confirmed or undone."""
    level_before: float = 1.0
    acceleration_m_s2: float = math.nan
    """Reverse acceleration of the reversal that caused the last correction."""
    error_m: float = math.nan
    """J of that reversal."""
    gain: float = GAIN
    waited: int = 0
    """Reversals at other accelerations since the last correction."""
    schedule: LevelSchedule = LevelSchedule()
    """Level over temperature."""


def next_state(state: AdaptationState, loop: LoopModel, reversal: ProductionReversal) -> AdaptationState:
    """State after a production reversal: the last correction is undone, or confirmed and a new one made."""
    reviewed = undo_if_worse(state, reversal)
    if reviewed.learned is not state.learned:
        return reviewed
    reviewed = _with_level_learned(reviewed, loop, reversal)
    if reviewed.before is not None and not _similar(state, reversal) and reviewed.waited < PATIENCE:
        return reviewed._replace(waited=reviewed.waited + 1)  # of another acceleration: not reviewed yet
    if reversal.error_m < UNCHANGED_BELOW_M:
        return reviewed._replace(before=None)
    learned, level = corrected_by(reviewed, loop, reversal)
    return AdaptationState(
        learned=learned,
        level=level,
        before=reviewed.learned,
        level_before=reviewed.level,
        acceleration_m_s2=reversal.acceleration_m_s2,
        error_m=reversal.error_m,
        gain=reviewed.gain,
        schedule=reviewed.schedule,
    )


def at_temperature(
    state: AdaptationState, loop: LoopModel, temperature_degc: float, elapsed_s: float
) -> AdaptationState:
    """State after `elapsed_s` at a temperature, which the level follows; NaN: it stands still."""
    schedule, factor = followed(state.schedule, temperature_degc, elapsed_s)
    level = float(np.clip(state.level * factor, *LEVEL_RANGE))
    if level == state.level:
        return state
    share = level / state.level
    return state._replace(
        learned=at_level(state.learned, loop, share),
        level=level,
        before=None if state.before is None else at_level(state.before, loop, share),
        level_before=state.level_before * share,
        schedule=schedule,
    )


def _with_level_learned(
    state: AdaptationState, loop: LoopModel, reversal: ProductionReversal
) -> AdaptationState:
    """State whose schedule knows the level that this reversal has measured, if it has a temperature."""
    if math.isnan(reversal.temperature_degc) or not _covers(state.learned, reversal.acceleration_m_s2):
        return state
    missing_n = _missing_after(loop, reversal.trace_m)
    growth, _ = _friction_growth(state.learned, loop, reversal.acceleration_m_s2, missing_n)
    return state._replace(schedule=learned_at(state.schedule, reversal.temperature_degc, state.level, growth))


def _covers(learned: WaveformLearned, acceleration_m_s2: float) -> bool:
    """Whether the waveform was learned at accelerations down to this one, or a similar one."""
    accelerations = learned.accelerations_m_s2
    return bool(accelerations) and acceleration_m_s2 >= accelerations[0] / SIMILAR_RATIO


def undo_if_worse(state: AdaptationState, reversal: ProductionReversal) -> AdaptationState:
    """Undo the last correction if a reversal at a similar acceleration is worse than the one before it."""
    if state.before is None or not _similar(state, reversal):
        return state
    if reversal.error_m > WORSE_RATIO * state.error_m + WORSE_OFFSET_M:
        jumped = reversal.error_m > JUMP_RATIO * state.error_m + WORSE_OFFSET_M
        gain = GAIN if jumped else max(0.5 * state.gain, GAIN_MIN)
        return AdaptationState(
            learned=state.before, level=state.level_before, gain=gain, schedule=state.schedule
        )
    return state._replace(before=None, gain=min(1.2 * state.gain, GAIN))


def _similar(state: AdaptationState, reversal: ProductionReversal) -> bool:
    ratio = reversal.acceleration_m_s2 / state.acceleration_m_s2
    return 1.0 / SIMILAR_RATIO <= ratio <= SIMILAR_RATIO


def corrected_by(
    state: AdaptationState, loop: LoopModel, reversal: ProductionReversal
) -> tuple[WaveformLearned, float]:
    """Waveform and level of friction after the correction by one reversal."""
    learned, a_m_s2 = state.learned, reversal.acceleration_m_s2
    accelerations = np.array(learned.accelerations_m_s2)
    if not _covers(learned, a_m_s2):
        return learned, state.level
    missing_n = _missing_after(loop, reversal.trace_m)
    growth, growth_n = _friction_growth(learned, loop, a_m_s2, missing_n)
    level = state.level
    if abs(growth) > (LEVEL_DEAD_BAND if math.isnan(reversal.temperature_degc) else 0.0):
        level = float(np.clip(level * (1.0 + state.gain * growth), *LEVEL_RANGE))
        learned = scaled(learned, level / state.level)
        missing_n = missing_n - growth_n
    place = float(np.interp(math.log(a_m_s2), np.log(accelerations), np.arange(len(accelerations))))
    lower = int(place)
    waves = list(learned.waves_n)
    for row, share in ((lower, 1.0 - (place - lower)), (lower + 1, place - lower)):
        if share > 0.0:
            gain = state.gain * share
            ratio = a_m_s2 / accelerations[row]
            waves[row] = _with_missing(np.array(waves[row]), missing_n, gain, loop, ratio)
    return learned._replace(waves_n=tuple(waves)), level


def _missing_after(loop: LoopModel, trace_m: Array) -> Array:
    """Missing force after a reversal (n,), relative to its start; the trace is extended oddly."""
    margin = round(4.0 / (2.0 * math.pi * FILTER_HZ * loop.period_s))
    extended_m = np.pad(trace_m, margin, mode="reflect", reflect_type="odd")
    missing_n = missing_force_n(loop, extended_m)[margin : margin + len(trace_m)]
    return np.asarray(missing_n - missing_n[0])


def _friction_growth(
    learned: WaveformLearned, loop: LoopModel, a_m_s2: float, missing_n: Array
) -> tuple[float, Array]:
    """Relative growth of friction that explains most of the missing force, and the explained part (n,)."""
    time_s = np.arange(len(missing_n)) * loop.period_s
    distance_m = 0.5 * a_m_s2 * time_s**2
    parts = [
        level_n * 2.0 * -np.expm1(-distance_m / slip_m)
        for level_n, slip_m in zip(learned.friction, loop.slip_m, strict=False)
    ]
    change_n = np.sum(parts, axis=0)
    norm_n2 = float(change_n @ change_n)
    share = float(missing_n @ change_n) / norm_n2 if norm_n2 > 0.0 else 0.0
    return share, share * change_n


def _with_missing(
    wave_n: Array, missing_n: Array, gain: float, loop: LoopModel, ratio: float
) -> tuple[float, ...]:
    """A waveform corrected by the force missing after a reversal of `ratio` times its acceleration."""
    ahead = round(loop.ahead_s / loop.period_s)
    source = (np.arange(len(wave_n)) - ahead + loop.dead_samples) / math.sqrt(ratio) - loop.dead_samples
    stretched_n = np.interp(source, np.arange(len(missing_n)), missing_n, left=0.0)
    change_n = corrected(np.zeros(len(wave_n)), stretched_n, gain, loop)
    return tuple((wave_n + change_n).round(4).tolist())  # parts outside of the trace are unchanged
