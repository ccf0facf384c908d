"""Strokes that learn what a rest adds to friction: moves with rests of one duration between them.

A stroke moves on, and turns back, twice each behind a rest.
"""

import numpy as np

from kernels.arrays import Array
from servo_ctrl.learning.performance import Indices

STILL_M = 1e-12
"""Step of the command up to which it stands; chosen: above rounding."""
REST_SHARE = 0.9
"""Share of the asked rest from which a standstill counts as one; chosen."""
TURNS = (True, False, True, False)
"""Which starts of a stroke turn: behind a first move from the centre, back, on, back, on."""
WAYS = (-1.0, 0.0, 1.0, 0.0, -1.0)
"""Where the moves of a stroke end, in radii from the centre."""


def moves_behind_rests(position_command_m: Array, rest_s: float, period_s: float) -> Indices:
    """Indices of the first samples of the moves behind a rest of at least `rest_s` in the commands (n,)."""
    moving = np.flatnonzero(np.abs(np.diff(position_command_m)) > STILL_M) + 1
    stood_s = np.diff(moving) * period_s
    return np.asarray(moving[1:][stood_s >= REST_SHARE * rest_s])


def rest_starts(position_command_m: Array, rest_s: float, period_s: float) -> Indices:
    """Indices (4,) of the starts of a stroke in its commands (n,).

    Raises ValueError when a rest is missing.
    """
    starts = moves_behind_rests(position_command_m, rest_s, period_s)[-len(TURNS) :]
    if len(starts) < len(TURNS):
        raise ValueError(f"the stroke has {len(starts)} rests of {rest_s:g} s, not {len(TURNS)}")
    return starts
