"""A learned waveform at another level of friction.

`scaled` multiplies its forces. `at_level` takes the stiffness of presliding as given, as friction models with
bristles do (Canudas de Wit et al. 1995; Al-Bender et al. 2005): less friction slips after a shorter distance,

    F'(x) = f F(x / f),    x = a t^2 / 2, so that F'(t) = f F(t / sqrt(f)) behind a reversal.

The law has fixed slip distances; what they cannot follow goes into the waveforms.
"""

import math

import numpy as np

from servo_ctrl.learning.reversal_waveform import SLOPES, LoopModel, WaveformLearned


def scaled(learned: WaveformLearned, share: float) -> WaveformLearned:
    """Scale levels and waveforms by a factor; the slopes over the motion are unchanged."""
    levels = tuple(level * share for level in learned.friction[:-SLOPES])
    waves = tuple(tuple(force * share for force in wave) for wave in learned.waves_n)
    return learned._replace(friction=(*levels, *learned.friction[-SLOPES:]), waves_n=waves)


def at_level(learned: WaveformLearned, loop: LoopModel, share: float) -> WaveformLearned:
    """Change friction by a factor at the same stiffness of presliding; the slopes are unchanged."""
    changed = scaled(learned, share)
    waves = []
    for a_m_s2, scaled_wave in zip(changed.accelerations_m_s2, changed.waves_n, strict=True):
        wave_n = np.array(scaled_wave)
        since = np.arange(len(wave_n)) - round(loop.ahead_s / loop.period_s) + loop.dead_samples
        behind = np.maximum(since, 0)  # periods since the reversal of the command at t + L
        places = np.arange(len(wave_n)) + behind * (1.0 / math.sqrt(share) - 1.0)
        stretched_n = np.interp(places, np.arange(len(wave_n)), wave_n)
        distance_m = 0.5 * a_m_s2 * (behind * loop.period_s) ** 2
        for level_n, slip_m in zip(changed.friction, loop.slip_m, strict=False):
            longer_n = np.exp(-distance_m / slip_m) - np.exp(-distance_m / (share * slip_m))
            stretched_n += 2.0 * level_n * longer_n
        waves.append(tuple(stretched_n.round(4).tolist()))
    return changed._replace(waves_n=tuple(waves))
