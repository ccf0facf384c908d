"""Learns what a rest adds to friction (`control.rest_memory`), relative to the waveform without rests.

A stroke moves on and turns back behind rests of one duration: two starts in the direction of the motion
before, and two against it. The learning law is that of `learning.reversal_waveform`, over the time since the
start; the table holds its result over the way.
"""

from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.control.rest_memory import SPAN_M, STILL_M
from servo_ctrl.learning.performance import Indices

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


class RestForce(NamedTuple):
    """What a rest adds to friction."""

    rest_s: float
    onward_n: tuple[float, ...]
    """In the direction of motion, at the ways of `control.rest_memory`, for a start that does not turn."""
    turned_n: tuple[float, ...]
    """For one that turns."""


def rest_table(rests: tuple[RestForce, ...]) -> Array | None:
    """The table of the control law, (r, 1 + 2 N); None without a rest."""
    if not rests:
        return None
    return np.array([(rest_s, *onward_n, *turned_n) for rest_s, onward_n, turned_n in rests])


def rest_starts(position_command_m: Array, rest_s: float, period_s: float) -> Indices:
    """Indices (4,) of the first samples behind the rests of a stroke in its commands (n,).

    Raises ValueError when a rest is missing.
    """
    moving = np.flatnonzero(np.abs(np.diff(position_command_m)) > STILL_M) + 1
    stood = np.diff(moving) * period_s
    starts: Indices = moving[1:][stood >= REST_SHARE * rest_s][-len(TURNS) :]
    if len(starts) < len(TURNS):
        raise ValueError(f"the stroke has {len(starts)} rests of {rest_s:g} s, not {len(TURNS)}")
    return starts


def over_way(wave_n: Array, way_m: Array) -> tuple[float, ...]:
    """The forces (n,), each at a way (n,) of the command at the lead, at the ways of a table."""
    taper = np.sin(0.5 * np.pi * np.clip((NODES - np.arange(1, NODES + 1)) / (TAPER_SHARE * NODES), 0.0, 1.0))
    forces_n = np.interp(NODE_WAYS_M, np.maximum.accumulate(way_m), wave_n, right=0.0)
    return tuple((forces_n * taper**2).round(4).tolist())
