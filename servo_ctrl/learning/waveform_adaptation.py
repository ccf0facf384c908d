"""The waveform goes on learning from reversals of production, no stroke made for it (ours).

From the error trace e of one reversal, over Tm, comes the force that was missing, m = P^-1 e. First its part
along the force that the friction with memory makes there, sum W_i 2 (1 - exp(-x / x_i)): friction has become
larger or smaller by that share, and with it all that was learned. What is left corrects the waveforms next to
this reverse acceleration, each by its share, stretched to its own time.

A change that did not help is taken back: `judged` compares the next reversal of about the same acceleration.
Learning goes on more slowly then, but where J has jumped it is the friction that has changed.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.learning.reversal_waveform import (
    FILTER_HZ,
    LoopModel,
    WaveformLearned,
    corrected,
    missing_force_n,
)

GAIN = 0.7
"""Of a change by one reversal; as between strokes."""
LEVEL_DEAD_BAND = 0.05
"""Smallest relative change of friction that is one; chosen: noise and position make as much."""
LEVEL_RANGE = (0.2, 5.0)
"""Bounds the level of friction against what strokes have learned; chosen."""
ALIKE = 1.25
"""Ratio of reverse accelerations up to which two reversals are compared; chosen."""
WORSE_SHARE, WORSE_M = 1.15, 0.05e-6
"""A change is taken back when J has grown beyond this share plus this; chosen: scatter of reversals."""
GOOD_ENOUGH_M = 0.1e-6
"""J below which nothing is changed; chosen: the resolution of the scale."""
JUMP = 3.0
"""Growth of J from one reversal to the next alike that no change of ours makes; chosen."""
SMALLEST_GAIN = 0.05
"""Bounds how slowly it learns; chosen."""


class SeenReversal(NamedTuple):
    """A reversal of production."""

    acceleration_m_s2: float
    trace_m: Array
    """(n,) error after it, positive where the axis lags behind its new direction."""
    error_m: float
    """J."""


class Adapting(NamedTuple):
    """Where the adaptation of an axis is."""

    learned: WaveformLearned
    """In use."""
    level: float = 1.0
    """Friction against what strokes have learned."""
    before: WaveformLearned | None = None
    """In use before the last change that is not judged yet."""
    level_before: float = 1.0
    acceleration_m_s2: float = math.nan
    """Of the reversal that made it."""
    error_m: float = math.nan
    """Its J."""
    gain: float = GAIN


def next_state(state: Adapting, loop: LoopModel, reversal: SeenReversal) -> Adapting:
    """After a reversal of production: a change taken back, or kept and the next one made."""
    judged_state = judged(state, reversal)
    if judged_state.learned is not state.learned:
        return judged_state
    if judged_state.before is not None and not _alike(state, reversal):
        return judged_state  # of another acceleration: the last change is still to be judged
    if reversal.error_m < GOOD_ENOUGH_M:
        return judged_state._replace(before=None)
    learned, level = changed(judged_state, loop, reversal)
    return Adapting(
        learned=learned,
        level=level,
        before=judged_state.learned,
        level_before=judged_state.level,
        acceleration_m_s2=reversal.acceleration_m_s2,
        error_m=reversal.error_m,
        gain=judged_state.gain,
    )


def judged(state: Adapting, reversal: SeenReversal) -> Adapting:
    """Take the last change back where this reversal, of about its acceleration, is worse than before."""
    if state.before is None or not _alike(state, reversal):
        return state
    if reversal.error_m > WORSE_SHARE * state.error_m + WORSE_M:
        jumped = reversal.error_m > JUMP * state.error_m + WORSE_M
        gain = GAIN if jumped else max(0.5 * state.gain, SMALLEST_GAIN)
        return Adapting(learned=state.before, level=state.level_before, gain=gain)
    return state._replace(before=None, gain=min(1.2 * state.gain, GAIN))


def _alike(state: Adapting, reversal: SeenReversal) -> bool:
    ratio = reversal.acceleration_m_s2 / state.acceleration_m_s2
    return 1.0 / ALIKE <= ratio <= ALIKE


def changed(state: Adapting, loop: LoopModel, reversal: SeenReversal) -> tuple[WaveformLearned, float]:
    """What one reversal makes of a waveform, and of the level of friction."""
    learned, a_m_s2 = state.learned, reversal.acceleration_m_s2
    known = np.array(learned.accelerations_m_s2)
    if not len(known) or not a_m_s2 >= known[0] / ALIKE:
        return learned, state.level
    missing_n = _missing_after(loop, reversal.trace_m)
    grown = _growth(learned, loop, a_m_s2, missing_n)
    level = state.level
    if abs(grown[0]) > LEVEL_DEAD_BAND:
        level = float(np.clip(level * (1.0 + state.gain * grown[0]), *LEVEL_RANGE))
        learned = scaled(learned, level / state.level)
        missing_n = missing_n - grown[1]
    place = float(np.interp(math.log(a_m_s2), np.log(known), np.arange(len(known))))
    lower = int(place)
    waves = list(learned.waves_n)
    for row, share in ((lower, 1.0 - (place - lower)), (lower + 1, place - lower)):
        if share > 0.0:
            gain = state.gain * share
            waves[row] = _with_missing(np.array(waves[row]), missing_n, gain, loop, a_m_s2 / known[row])
    return learned._replace(waves_n=tuple(waves)), level


def _missing_after(loop: LoopModel, trace_m: Array) -> Array:
    """What was missing after a reversal (n,), against its moment; the trace goes on evenly at both ends."""
    margin = round(4.0 / (2.0 * math.pi * FILTER_HZ * loop.period_s))
    whole_m = np.pad(trace_m, margin, mode="reflect", reflect_type="odd")
    missing_n = missing_force_n(loop, whole_m)[margin : margin + len(trace_m)]
    return np.asarray(missing_n - missing_n[0])


def _growth(
    learned: WaveformLearned, loop: LoopModel, a_m_s2: float, missing_n: Array
) -> tuple[float, Array]:
    """The relative growth of friction that explains most of what was missing, and that part of it (n,)."""
    time_s = np.arange(len(missing_n)) * loop.period_s
    distance_m = 0.5 * a_m_s2 * time_s**2
    parts = [
        level_n * 2.0 * -np.expm1(-distance_m / slip_m)
        for level_n, slip_m in zip(learned.friction, loop.slip_m, strict=False)
    ]
    change_n = np.sum(parts, axis=0)
    square = float(change_n @ change_n)
    share = float(missing_n @ change_n) / square if square > 0.0 else 0.0
    return share, share * change_n


def scaled(learned: WaveformLearned, share: float) -> WaveformLearned:
    """A friction larger by a share: levels and waveforms; what goes with speed or acceleration stays."""
    levels = tuple(level * share for level in learned.friction[:-2])
    waves = tuple(tuple(force * share for force in wave) for wave in learned.waves_n)
    return learned._replace(friction=(*levels, *learned.friction[-2:]), waves_n=waves)


def _with_missing(
    wave_n: Array, missing_n: Array, gain: float, loop: LoopModel, ratio: float
) -> tuple[float, ...]:
    """A waveform with what was missing after a reversal of `ratio` times its acceleration."""
    ahead = round(loop.ahead_s / loop.period_s)
    own = (np.arange(len(wave_n)) - ahead + loop.dead_samples) / math.sqrt(ratio) - loop.dead_samples
    around_n = np.interp(own, np.arange(len(missing_n)), missing_n, left=0.0)
    change_n = corrected(np.zeros(len(wave_n)), around_n, gain, loop)
    return tuple((wave_n + change_n).round(4).tolist())  # what no trace shows stays as it is
