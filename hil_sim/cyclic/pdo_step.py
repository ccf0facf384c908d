"""PDOs of all nodes at a SYNC: received RPDOs take effect, then TPDOs are filled.

`numbers` (n,) are the process objects of all devices; an entry of a mapping is a `MappedPlace` among them.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from can_frames.frame import DATA_AT
from hil_sim.cyclic.drive_record import NO_SET_POINT
from kernels.arrays import Array, Index
from kernels.jit import kernel
from kernels.record_layout import record_type, store

Bytes = NDArray[np.uint8]
DRIVES_ACT = -1
"""Returned in place of a count: drives must act on new object values before TPDOs are filled."""


class MappedPlace(NamedTuple):
    """An object of a PDO: its bytes there (little-endian) and its place among the numbers."""

    pdo: int
    start: int
    size: int
    signed: bool
    place: int
    low: float
    high: float


def mapped_places(entries: list[MappedPlace]) -> NDArray[Any]:
    """Return records (entries,) for the kernels."""
    places = np.zeros(len(entries), record_type(MappedPlace))
    store(places, entries)
    return places


@kernel
def exchange(
    numbers: Array,
    axes: Any,
    objects: Any,
    received: Any,
    data: Bytes,
    arrived: NDArray[np.bool_],
    drive_of: Index,
    acting: NDArray[np.bool_],
    sent: Any,
    headers: Bytes,
    turns: Index,
    frames: Bytes,
) -> int:
    """Write the `data` (RPDOs, 8) of `arrived` RPDOs (RPDOs,) to the process objects, then fill the TPDOs.

    `arrived` is cleared. `drive_of` (RPDOs,): the drive that each RPDO belongs to, -1: none. Returns the
    number of filled frames; DRIVES_ACT where a drive must act first (`must_act`): `acting` (drives,) marks
    each.
    """
    for entry in range(len(received)):
        at = received[entry]
        if arrived[at["pdo"]]:
            value = integer(data[at["pdo"]], at)
            if at["low"] <= value <= at["high"]:
                numbers[at["place"]] = value
    acting[:] = False
    any_acts = False
    for rpdo in range(len(drive_of)):
        drive = drive_of[rpdo]
        if arrived[rpdo] and drive >= 0 and must_act(axes[drive], objects[drive]):
            acting[drive] = any_acts = True
    arrived[:] = False
    return DRIVES_ACT if any_acts else fill(numbers, sent, headers, turns, frames)


@kernel
def integer(data: Bytes, at: Any) -> int:
    """Return the integer at a place of a PDO."""
    value = 0
    for byte in range(at["size"]):
        value |= int(data[at["start"] + byte]) << (8 * byte)
    if at["signed"] and value >> (8 * at["size"] - 1):
        value -= 1 << (8 * at["size"])
    return value


@kernel
def must_act(axis: Any, own: Any) -> bool:
    """Return whether a drive must act on new object values; set points are read in its tick."""
    return bool(
        own["controlword"] != axis["acted_controlword"]
        or axis["state"] != axis["acted_state"]
        or own["modes_of_operation"] != own["modes_of_operation_display"]
        or own["max_torque"] != axis["acted_max_torque"]
        or own["max_current"] != axis["acted_max_current"]
        or own["positive_torque_limit_value"] != axis["acted_positive_torque"]
        or own["negative_torque_limit_value"] != axis["acted_negative_torque"]
        or own["physical_outputs"] != axis["acted_physical_outputs"]
        or own["bit_mask"] != axis["acted_bit_mask"]
        or own["touch_probe_function"] != axis["acted_probe_function"]
        or own["interpolation_data_record"] != NO_SET_POINT
    )


@kernel
def fill(numbers: Array, sent: Any, headers: Bytes, turns: Index, frames: Bytes) -> int:
    """Fill the TPDOs of this SYNC into consecutive `frames` (TPDOs, 16); return their number.

    `headers` (TPDOs, 8) begin them. `turns` (TPDOs, 2): the number of SYNCs from one transmission to the
    next, and the number since the last one. A value that does not fit wraps, as a counter does.
    """
    count, last = 0, -1
    due = False
    for entry in range(len(sent)):
        at = sent[entry]
        if at["pdo"] != last:
            last = at["pdo"]
            turns[last, 1] += 1
            due = turns[last, 1] >= turns[last, 0]
            if due:
                turns[last, 1] = 0
                frames[count] = 0
                for byte in range(DATA_AT):  # an assignment of arrays has numba compile a message on shapes
                    frames[count, byte] = headers[last, byte]
                count += 1
        if due:
            value, first = int(numbers[at["place"]]), DATA_AT + at["start"]
            for byte in range(at["size"]):
                frames[count - 1, first + byte] = (value >> (8 * byte)) & 0xFF
    return count
