"""Search bands of spectral lines over screw turns and over time, and the names of orders."""

from collections.abc import Sequence

import numpy as np

from kernels.arrays import Array, Index
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.location.spectral_lines import Line, Track, octaves
from reconcile.regression.regression_data import FILTER_HZ
from reconcile.regression.residual import Residual

LOWEST_HZ, HIGHEST_HZ = 0.5, 2.0 * FILTER_HZ
"""Above, the state filter leaves less than 9 % of a line."""
LOWEST_ORDER, HIGHEST_ORDER = 0.45, 100.0
"""Cycles a turn of the screw."""
GRATING_ORDERS = (0.4, 4.2)
"""Cycles a grating period."""


def order_bands(axis: NominalAxis) -> list[tuple[float, float]]:
    """Bands of cycles a turn to search: those of screw and motor, and those of the scale's grating."""
    bands = octaves(LOWEST_ORDER, HIGHEST_ORDER)
    if axis.grating_m is not None:
        low, high = (order * axis.lead_m / axis.grating_m for order in GRATING_ORDERS)
        bands += octaves(max(low, HIGHEST_ORDER), high)
    return bands


def time_bands(residuals: Sequence[Residual]) -> list[tuple[float, float]]:
    """Bands of frequencies (Hz) to search."""
    return octaves(LOWEST_HZ, min(HIGHEST_HZ, 0.4 / max(residual.data.period_s for residual in residuals)))


def over_turns(residual: Residual, values: Array) -> Track:
    """The samples in use while the axis moves, over turns of the screw."""
    m = residual.data.motion
    used = residual.used & ~m.standing_still
    turns_s = np.abs(m.velocity_m_s[used]) / residual.data.lead_m
    block = _blocks(residual)[used]
    return Track(values[used], m.position_m[used] / residual.data.lead_m, turns_s, turns_s, block)


def over_time(residual: Residual, values: Array) -> Track:
    """The samples in use, over time."""
    used = residual.used
    same = np.ones(int(used.sum()))
    return Track(
        values[used], residual.data.time_s[used], same, same * FILTER_HZ / HIGHEST_HZ, _blocks(residual)[used]
    )


def _blocks(residual: Residual) -> Index:
    return np.floor(residual.data.time_s).astype(np.int64)


def periods(axis: NominalAxis) -> list[tuple[str, float]]:
    """Periods of drive train and scale, the longest first, where the model has them: name, cycles a turn."""
    found = [("turn", 1.0)]
    if axis.pole_pairs is not None:
        found.append(("pole pair", float(axis.pole_pairs)))
    if axis.grating_m is not None:
        found.append(("grating period", axis.lead_m / axis.grating_m))
    return found


def order_name(line: Line, axis: NominalAxis) -> str:
    """Name of an order, such as `2 a pole pair`; empty where no period of the model fits it."""
    for name, cycles_per_turn in reversed(periods(axis)):
        multiple = line.cycles / cycles_per_turn
        off = abs(multiple - round(multiple)) * cycles_per_turn
        if round(multiple) >= 1 and off < max(line.width, 0.01 * cycles_per_turn):
            return f"{round(multiple)} a {name}"
    return ""
