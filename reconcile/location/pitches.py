"""Search bands of spectral lines over screw turns and over time, and the names of orders."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from reconcile.location.spectral_lines import Line, Track, octaves
from reconcile.nominal_model.nominal_axis import NominalAxis
from reconcile.regression.regression_data import FILTER_HZ
from reconcile.regression.residual import Residual

Index = NDArray[np.int64]

LOWEST_HZ, HIGHEST_HZ = 0.5, 2.0 * FILTER_HZ
"""Above, the state filter leaves less than 9 % of a line."""
LOWEST_ORDER, HIGHEST_ORDER = 0.45, 100.0
"""Cycles a turn of the screw."""
GRATING_ORDERS = (0.4, 4.2)
"""Cycles a grating period."""


class Pitches(NamedTuple):
    """Periods of the drive train and the scale; None where the model does not say."""

    lead_m: float
    pole_pairs: int | None
    grating_m: float | None


def pitches_of(axis: NominalAxis) -> Pitches:
    """Read the pitches of an axis from its nominal model."""
    return Pitches(axis.lead_m, axis.pole_pairs, axis.grating_m)


def order_bands(pitches: Pitches) -> list[tuple[float, float]]:
    """Bands of cycles a turn to search: those of screw and motor, and those of the scale's grating."""
    bands = octaves(LOWEST_ORDER, HIGHEST_ORDER)
    if pitches.grating_m is not None:
        turn = pitches.lead_m / pitches.grating_m
        low, high = (order * turn for order in GRATING_ORDERS)
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


def order_name(line: Line, pitches: Pitches) -> str:
    """Name of an order, such as `2 a pole pair`; empty where no pitch of the model fits it."""
    within = [("turn", 1.0)]
    if pitches.pole_pairs is not None:
        within.append(("pole pair", float(pitches.pole_pairs)))
    if pitches.grating_m is not None:
        within.append(("grating period", pitches.lead_m / pitches.grating_m))
    for name, cycles_per_turn in reversed(within):
        multiple = line.cycles / cycles_per_turn
        if round(multiple) >= 1 and abs(multiple - round(multiple)) * cycles_per_turn < max(
            line.width, 0.01 * cycles_per_turn
        ):
            return f"{round(multiple)} a {name}"
    return ""
