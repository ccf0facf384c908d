"""Learns what a rest adds to friction (`control.rest_memory`), relative to the waveform without rests.

A stroke moves on and turns back behind rests of one duration: two starts in the direction of the motion
before, and two against it. The learning law is that of `learning.reversal_waveform`, over the time since the
start; the table holds its result over the way.
"""

import numpy as np

from kernels.arrays import Array
from servo_ctrl.control.rest_memory import SPAN_M, STILL_M
from servo_ctrl.learning.performance import Indices
from servo_ctrl.learning.reversal_waveform import LoopModel, RestForce, corrected

NODES = 50
"""Forces of a row over the way. Chosen: about one a millisecond for a start at 50 m/s^3."""
TAPER_SHARE = 0.2
"""Share of the nodes, at the end, over which a force fades to zero; chosen: the last half of the way."""
REST_SHARE = 0.9
"""Share of the asked rest from which a standstill counts as one; chosen."""
TURNS = (True, False, True, False)
"""Which starts of a stroke turn: behind a first move from the centre, back, on, back, on."""
WAYS = (-1.0, 0.0, 1.0, 0.0, -1.0)
"""Where the moves of a stroke end, in radii from the centre."""
NODE_WAYS_M = SPAN_M * (np.arange(1, NODES + 1) / NODES) ** 3
"""Ways at which a table holds forces, (NODES,)."""


def no_rest_force(rest_s: float) -> RestForce:
    """No force behind a rest."""
    return RestForce(rest_s, (0.0,) * NODES, (0.0,) * NODES)


def rest_table(rests: tuple[RestForce, ...]) -> Array | None:
    """The table of the control law, (r, 1 + 2 N); None without a rest."""
    if not rests:
        return None
    return np.array([(row.rest_s, *row.onward_n, *row.turned_n) for row in rests])


def moves_behind_rests(position_command_m: Array, rest_s: float, period_s: float) -> Indices:
    """Indices of the first samples of the moves behind a rest of at least `rest_s` in the commands (n,)."""
    moving = np.flatnonzero(np.abs(np.diff(position_command_m)) > STILL_M) + 1
    stood_s = np.diff(moving) * period_s
    return np.asarray(moving[1:][stood_s >= REST_SHARE * rest_s])


def rest_starts(position_command_m: Array, rest_s: float, period_s: float) -> Indices:
    """Indices (4,) of the starts of a stroke in its commands (n,). Raises ValueError when a rest is missing."""
    starts = moves_behind_rests(position_command_m, rest_s, period_s)[-len(TURNS) :]
    if len(starts) < len(TURNS):
        raise ValueError(f"the stroke has {len(starts)} rests of {rest_s:g} s, not {len(TURNS)}")
    return starts


def corrected_over_way(
    force_n: tuple[float, ...], missing_n: Array, way_m: Array, loop: LoopModel, gain: float
) -> tuple[float, ...]:
    """The next forces of a row from the missing force (n,).

    `way_m` (n,): of the command at the lead, at the samples of `missing_n`.
    """
    way_m = np.maximum.accumulate(way_m)
    wave_n = np.interp(way_m, [0.0, *NODE_WAYS_M], [0.0, *force_n], right=0.0)
    wave_n = np.interp(NODE_WAYS_M, way_m, corrected(wave_n, missing_n, gain, loop), right=0.0)
    fade = np.clip((NODES - np.arange(1, NODES + 1)) / (TAPER_SHARE * NODES), 0.0, 1.0)
    return tuple((wave_n * np.sin(0.5 * np.pi * fade) ** 2).round(4).tolist())
