"""Frames in, frames out, in one call: the set points of all nodes and the SYNC, up to their TPDOs.

What is rare is left to the caller: the call ends in front of a frame that is none of the cycle's, and tells
where a tick or a set point has something to act on.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from can_frames.frame import DATA_AT, FRAME_BYTES, LARGEST_STANDARD
from hil_sim.cyclic.drive_step import follow_axes, lead_axes
from hil_sim.cyclic.pdo_step import DRIVES_ACT, Bytes, exchange
from hil_sim.cyclic.scale_step import read_scales
from hil_sim.plant.integrate import advance
from kernels.arrays import Array, Index
from kernels.jit import kernel

NOBODYS, OTHER, SYNC, FIRST_RPDO = 0, 1, 2, 3
"""Kinds of an identifier; an RPDO's is `FIRST_RPDO` and its place."""
USED_UP, OTHERS_FRAME, SERVED, FOUND, ACTS = 0, 1, 2, 3, 4
"""How a call ends: no frame left; at a frame that is not for it; at a SYNC, served; with a tick that has
found something; with drives that have something to act on before they answer."""
NO_SYNC = -1
"""As `substeps`: a SYNC is not for this call."""
SIZE_AT = 4


@kernel
def serve_burst(
    burst: Bytes,
    first: int,
    count: int,
    substeps: int,
    ticks: int,
    substep_us: float,
    cycle_us: float,
    kinds: Index,
    sizes: Index,
    data: Bytes,
    came: NDArray[np.bool_],
    params: Any,
    state: Any,
    setpoint: Any,
    axes: Any,
    objects: Any,
    words: Index,
    found: Index,
    scales: Any,
    scale_objects: Any,
    numbers: Array,
    received: Any,
    drive_of: Index,
    acts: NDArray[np.bool_],
    sent: Any,
    headers: Bytes,
    turns: Index,
    frames: Bytes,
) -> tuple[int, int, int]:
    """Serve the frames from number `first` to `count` of `burst`, up to the first SYNC.

    A SYNC advances time by `substeps` in `ticks`. `kinds` (2048,) are those of the identifiers, `sizes`
    (RPDOs,) the bytes of each, negative where another length is not settled; `words` (2,) the statuswords of
    `follow_axes`; the other arrays are those of `exchange` and of the ticks. Returns how it ended, the number
    of the frame, and as a third: `SERVED` how many `frames` there are, `FOUND` how many ticks are over.
    """
    for number in range(first, count):
        at = number * FRAME_BYTES
        header, size = 0, int(burst[at + SIZE_AT])
        for byte in range(4):  # of a small-endian machine, as `frame.HEADER` reads it there
            header |= int(burst[at + byte]) << (8 * byte)
        kind = kinds[header] if header <= LARGEST_STANDARD else OTHER
        if kind == NOBODYS:
            continue
        if kind >= FIRST_RPDO and sizes[kind - FIRST_RPDO] == size:
            for byte in range(size):
                data[kind - FIRST_RPDO, byte] = burst[at + DATA_AT + byte]
            came[kind - FIRST_RPDO] = True
            continue
        if kind != SYNC or size or substeps == NO_SYNC:
            return OTHERS_FRAME, number, 0
        for tick in range(ticks):
            own = substeps * (tick + 1) // ticks - substeps * tick // ticks
            dt_us = own * substep_us
            dt_s = dt_us * 1e-6
            lead_axes(axes, objects, setpoint, dt_s, dt_us / cycle_us)
            advance(params, state, setpoint, own, substep_us * 1e-6)
            anything = follow_axes(axes, objects, state, dt_s, words[0], words[1], found)
            read_scales(scales, scale_objects, state)
            if anything:
                return FOUND, number, tick + 1
        made = exchange(
            numbers, axes, objects, received, data, came, drive_of, acts, sent, headers, turns, frames
        )
        return (ACTS, number, 0) if made == DRIVES_ACT else (SERVED, number, made)
    return USED_UP, count, 0
