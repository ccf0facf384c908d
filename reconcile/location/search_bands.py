"""Where spectral lines are sought: bands over screw turns and over time, tracks, and the names of orders."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array, Index
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.location.spectra import Band, Track, octaves
from reconcile.location.spectral_lines import SpectralLine
from reconcile.regression.filter_ends import FILTER_HZ
from reconcile.regression.residual import Residual

LOWEST_HZ, HIGHEST_HZ = 0.5, 2.0 * FILTER_HZ
"""Above, the state filter leaves less than 9 % of a line."""
MOST_CYCLES_PER_SAMPLE = 0.4
"""Highest frequency over the sampling frequency: below the Nyquist limit of 0.5."""
LOWEST_ORDER, HIGHEST_ORDER = 0.45, 100.0
"""Cycles a turn of the screw; below one turn for what repeats every second turn."""
GRATING_ORDERS = (0.4, 4.2)
"""Cycles a grating period: interpolation errors are of orders 1 to 4."""
ORDER_TOLERANCE = 0.01
"""Least tolerance of the multiple of a period, as a share of it; chosen."""


def order_bands(axis: NominalAxis) -> list[Band]:
    """Bands of cycles a turn to search: those of screw and motor, and those of the scale's grating."""
    bands = octaves(LOWEST_ORDER, HIGHEST_ORDER)
    if axis.grating_m is not None:
        low, high = (order * axis.lead_m / axis.grating_m for order in GRATING_ORDERS)
        bands += octaves(max(low, HIGHEST_ORDER), high)
    return bands


def time_bands(residuals: Sequence[Residual]) -> list[Band]:
    """Bands of frequencies (Hz) to search."""
    longest_period_s = max(residual.data.period_s for residual in residuals)
    return octaves(LOWEST_HZ, min(HIGHEST_HZ, MOST_CYCLES_PER_SAMPLE / longest_period_s))


def over_turns(residual: Residual, values: Array) -> Track:
    """The samples in use while the axis moves, over turns of the screw."""
    motion, lead_m = residual.data.motion, residual.data.lead_m
    used = residual.used & ~motion.standing_still
    turns_per_s = np.abs(motion.velocity_m_s[used]) / lead_m
    return Track(
        values=values[used],
        abscissa=motion.position_m[used] / lead_m,
        weight=turns_per_s,
        rate_1_s=turns_per_s,
        block=_blocks(residual)[used],
    )


def over_time(residual: Residual, values: Array) -> Track:
    """The samples in use, over time."""
    used = residual.used
    ones = np.ones(int(used.sum()))
    return Track(
        values=values[used],
        abscissa=residual.data.time_s[used],
        weight=ones,
        rate_1_s=ones * FILTER_HZ / HIGHEST_HZ,  # lines are sought up to HIGHEST_HZ, above the filter
        block=_blocks(residual)[used],
    )


def _blocks(residual: Residual) -> Index:
    """The block of each sample (n,): seconds of run time."""
    return np.floor(residual.data.time_s).astype(np.int64)


class Period(NamedTuple):
    """A period of the drive train or of the scale."""

    name: str
    cycles_per_turn: float


def periods(axis: NominalAxis) -> list[Period]:
    """Periods of drive train and scale that the model has, the longest first."""
    known = [Period("turn", 1.0)]
    if axis.pole_pairs is not None:
        known.append(Period("pole pair", float(axis.pole_pairs)))
    if axis.grating_m is not None:
        known.append(Period("grating period", axis.lead_m / axis.grating_m))
    return known


def order_name(line: SpectralLine, axis: NominalAxis) -> str:
    """Name of an order, such as `2 a pole pair`; empty where no period of the model fits it."""
    for period in reversed(periods(axis)):
        multiple = line.cycles / period.cycles_per_turn
        difference = abs(multiple - round(multiple)) * period.cycles_per_turn
        tolerance = max(line.width, ORDER_TOLERANCE * period.cycles_per_turn)
        if round(multiple) >= 1 and difference < tolerance:
            return f"{round(multiple)} a {period.name}"
    return ""
