"""One communication cycle in one compiled call: from received RPDOs and the SYNC to the TPDOs of all nodes.

Rare cases are left to the caller: the call returns at a frame that is not part of the cycle, after a tick
with a finding (a switch, a following error), and where a drive must act on a new object value first.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from can_frames.frame import DATA_AT, FRAME_BYTES, LARGEST_STANDARD
from hil_sim.cyclic.drive_step import command_axes, supervise_axes
from hil_sim.cyclic.pdo_step import DRIVES_ACT, Bytes, exchange
from hil_sim.cyclic.scale_step import read_scales
from hil_sim.plant.integrate import advance
from kernels.arrays import Array, Index
from kernels.jit import kernel

NO_RECEIVER, BY_CALLER, SYNC, FIRST_RPDO = 0, 1, 2, 3
"""Kinds of an identifier: no node receives it; the caller handles it; SYNC; RPDO number n: FIRST_RPDO + n."""
BURST_DONE, FRAME_FOR_CALLER, SYNC_DONE, TICK_HAS_FINDING, DRIVES_MUST_ACT = 0, 1, 2, 3, 4
"""Endings of a call: all frames are served; at a frame for the caller; after a SYNC, with its TPDOs;
after a tick with a finding; at a SYNC, before drives act on new object values and the TPDOs are filled."""
NO_SYNC = -1
"""Value of `substeps` if the caller handles a SYNC."""
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
    arrived: NDArray[np.bool_],
    params: Any,
    state: Any,
    setpoint: Any,
    axes: Any,
    objects: Any,
    statuswords: Index,
    findings: Index,
    scales: Any,
    scale_objects: Any,
    numbers: Array,
    received: Any,
    drive_of: Index,
    acting: NDArray[np.bool_],
    sent: Any,
    headers: Bytes,
    turns: Index,
    frames: Bytes,
) -> tuple[int, int, int]:
    """Serve the frames from number `first` to `count` of `burst`, up to the first SYNC.

    A SYNC advances time by `substeps` in `ticks`. `kinds` (2048,) are those of the identifiers, `sizes`
    (RPDOs,) the bytes of each, negative while a wrong length is reported; `statuswords` (2,) those of
    `supervise_axes`; the other arrays are those of `exchange` and of the ticks.

    Returns how it ended, the number of the frame, and a count: for SYNC_DONE that of the filled `frames`, for
    TICK_HAS_FINDING that of the completed ticks.
    """
    for number in range(first, count):
        at = number * FRAME_BYTES
        header, size = 0, int(burst[at + SIZE_AT])
        for byte in range(4):  # of a small-endian machine, as `frame.HEADER` reads it there
            header |= int(burst[at + byte]) << (8 * byte)
        kind = kinds[header] if header <= LARGEST_STANDARD else BY_CALLER
        if kind == NO_RECEIVER:
            continue
        if kind >= FIRST_RPDO and sizes[kind - FIRST_RPDO] == size:
            for byte in range(size):
                data[kind - FIRST_RPDO, byte] = burst[at + DATA_AT + byte]
            arrived[kind - FIRST_RPDO] = True
            continue
        if kind != SYNC or size or substeps == NO_SYNC:
            return FRAME_FOR_CALLER, number, 0
        for tick in range(ticks):
            own = substeps * (tick + 1) // ticks - substeps * tick // ticks
            dt_us = own * substep_us
            dt_s = dt_us * 1e-6
            command_axes(axes, objects, setpoint, dt_s, dt_us / cycle_us)
            advance(params, state, setpoint, own, substep_us * 1e-6)
            has_finding = supervise_axes(axes, objects, state, dt_s, statuswords[0], statuswords[1], findings)
            read_scales(scales, scale_objects, state)
            if has_finding:
                return TICK_HAS_FINDING, number, tick + 1
        filled = exchange(
            numbers, axes, objects, received, data, arrived, drive_of, acting, sent, headers, turns, frames
        )
        return (DRIVES_MUST_ACT, number, 0) if filled == DRIVES_ACT else (SYNC_DONE, number, filled)
    return BURST_DONE, count, 0
