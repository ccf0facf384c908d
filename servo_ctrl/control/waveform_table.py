"""Reads learned waveforms: force over the time since a reversal, a row for each reverse acceleration.

A row has its reverse acceleration, m/s^2, then the force, N, each period from `AHEAD_S` before a reversal
into the positive direction on.
"""

import math

from kernels.jit import kernel
from kernels.record_layout import Table

AHEAD_S = 0.03
"""How long before a reversal the waveform begins. Chosen: more than ten dead times at 1 kHz."""


@kernel
def wave_in_row(
    waves: Table, row: int, since_s: float, reverse_m_s2: float, lead_s: float, period_s: float
) -> float:
    """The waveform of one row, `since_s` after the reversal of the command at t + L; 0 outside of the row.

    After the reversal, equal distances a t^2 / 2 correspond; before it, equal times.
    """
    stretch = math.sqrt(reverse_m_s2 / waves[row, 0]) if since_s > 0.0 else 1.0
    # learning takes the first increment of the new direction for the reversal: on average a period late
    place = (AHEAD_S - lead_s + since_s * stretch) / period_s - 1.0
    if not 0.0 <= place < waves.shape[1] - 2:
        return 0.0
    column = int(place)
    share = place - column
    return float((1.0 - share) * waves[row, 1 + column] + share * waves[row, 2 + column])


@kernel
def wave_n(waves: Table, since_s: float, reverse_m_s2: float, lead_s: float, period_s: float) -> float:
    """w, N: interpolated over the logarithm of the acceleration, held above the table, fading to 0 below."""
    last = waves.shape[0] - 1
    if not reverse_m_s2 > 0.0 or not waves[0, 0] > 0.0:
        return 0.0
    fade = min(reverse_m_s2 / waves[0, 0], 1.0)
    within_m_s2 = min(max(reverse_m_s2, waves[0, 0]), waves[last, 0])
    lower = 0
    while lower < last - 1 and waves[lower + 1, 0] <= within_m_s2:
        lower += 1
    upper = min(lower + 1, last)
    share = 0.0
    if waves[upper, 0] > waves[lower, 0]:
        share = math.log(within_m_s2 / waves[lower, 0]) / math.log(waves[upper, 0] / waves[lower, 0])
    lower_n = wave_in_row(waves, lower, since_s, reverse_m_s2, lead_s, period_s)
    upper_n = wave_in_row(waves, upper, since_s, reverse_m_s2, lead_s, period_s)
    return float(fade * ((1.0 - share) * lower_n + share * upper_n))


@kernel
def wave_at_n(waves: Table, distance_m: float, speed_m_s: float, lead_s: float, period_s: float) -> float:
    """w, N, `distance_m` behind a reversal at `speed_m_s` >= 0; below the table its slowest row is held."""
    slowest_m_s2 = waves[0, 0]
    if not distance_m > 0.0 or not slowest_m_s2 > 0.0:
        return 0.0
    as_of_m_s2 = max(speed_m_s * speed_m_s / (2.0 * distance_m), slowest_m_s2)
    return wave_n(waves, math.sqrt(2.0 * distance_m / as_of_m_s2), as_of_m_s2, lead_s, period_s)
