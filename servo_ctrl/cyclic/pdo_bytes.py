"""Bytes of the bus <-> the records of an axis: TPDOs into its inputs, its set points into RPDOs."""

import math
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Index
from kernels.jit import kernel

Bytes = NDArray[np.uint8]


class RpdoValue(IntEnum):
    """What an object of an RPDO carries."""

    ZERO = 0
    CONTROLWORD = 1
    MODE = 2
    TORQUE = 3
    TORQUE_OFFSET = 4
    VELOCITY = 5
    POSITION = 6
    VELOCITY_OFFSET = 7


_CONTROLWORD, _MODE, _TORQUE = int(RpdoValue.CONTROLWORD), int(RpdoValue.MODE), int(RpdoValue.TORQUE)
_TORQUE_OFFSET, _VELOCITY = int(RpdoValue.TORQUE_OFFSET), int(RpdoValue.VELOCITY)
_POSITION, _VELOCITY_OFFSET = int(RpdoValue.POSITION), int(RpdoValue.VELOCITY_OFFSET)


@kernel
def integer(inputs: Bytes, place: Any) -> int:
    """The integer at a place of a TPDO, little-endian."""
    value = 0
    for byte in range(place["size"]):
        value |= int(inputs[place["input"], place["start"] + byte]) << (8 * byte)
    if place["signed"] and value >> (8 * place["size"] - 1):
        value -= 1 << (8 * place["size"])
    return value


@kernel
def take_inputs(axis: Any, data: Bytes, came: NDArray[np.bool_]) -> bool:
    """Decode what came in this cycle; what did not is NaN. Return whether all has come.

    A drive has answered when all its TPDOs are there that come with every SYNC.
    """
    wiring, inputs = axis["wiring"], axis["inputs"]
    drive_came = came[wiring["drive"]]
    for place in range(wiring["further"], wiring["further"] + wiring["further_count"]):
        drive_came &= came[place]
    scale = wiring["scale"]
    scale_came = scale >= 0 and came[max(scale, 0)]
    inputs["previous_motor_m"] = inputs["motor_m"]
    inputs["motor_m"] = inputs["current_a"] = inputs["scale_raw_m"] = inputs["scale_m"] = math.nan
    if drive_came:
        if wiring["statusword"]["size"]:
            inputs["statusword"] = integer(data, wiring["statusword"])
        inputs["counts"] = integer(data, wiring["position"])
        inputs["motor_m"] = inputs["counts"] * wiring["metre_per_count"]
        inputs["current_a"] = inputs["current_held_a"]
        if wiring["current"]["size"]:
            inputs["current_a"] = integer(data, wiring["current"]) * wiring["ampere_per_permille"]
        if wiring["mode_shown"]["size"]:
            inputs["mode_shown"] = integer(data, wiring["mode_shown"])
    if scale_came:
        inputs["scale_raw_m"] = integer(data, wiring["scale_position"]) * wiring["scale_metre_per_count"]
        inputs["scale_m"] = inputs["scale_raw_m"] + inputs["scale_offset_m"]
    complete: bool = drive_came and (scale_came or scale < 0)
    return complete


@kernel
def encode(axis: Any, outputs: Index, data: Bytes) -> None:
    """Fill the RPDO: `outputs` (objects, 2) are the `RpdoValue` and the size of each object, in order."""
    at = 0
    for place in range(len(outputs)):
        value = set_point(axis, outputs[place, 0])
        for byte in range(outputs[place, 1]):
            data[at] = (value >> (8 * byte)) & 0xFF
            at += 1


@kernel
def set_point(axis: Any, output: int) -> int:
    """One of the values that an RPDO may carry."""
    counts, value = axis["law"]["counts"], 0
    if output == _CONTROLWORD:
        value = axis["controlword"]
    elif output == _MODE:
        value = axis["sent_mode"]
    elif output == _TORQUE:
        value = counts["torque"]
    elif output == _TORQUE_OFFSET:
        value = counts["torque_offset"]
    elif output == _VELOCITY:
        value = counts["velocity"]
    elif output == _POSITION:
        value = counts["position"]
    elif output == _VELOCITY_OFFSET:
        value = counts["velocity_offset"]
    return value
