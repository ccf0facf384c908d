"""Contour control in the cycle: between the inputs and the laws it reads both axes and leads both.

The errors are those of this cycle, so that the coupling costs no period. There is one record a coupled pair,
hence none where contour control is off.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from kernels.jit import kernel
from kernels.record_layout import record_type, store
from kernels.records import read, write
from servo_ctrl.control.contour_control import Pair, Params, State, at_rest, coupled


class Coupling(NamedTuple):
    """Two axes, by their numbers, and the law that couples them."""

    first: int
    second: int
    law: Params


class ContourRecord(NamedTuple):
    """What lies in memory of a coupled pair."""

    axes: Coupling
    state: State
    error_m: float
    """Contour error of the last cycle; NaN while the pair is not led along a path or an input is missing."""


def contour_records(couplings: Sequence[Coupling]) -> NDArray[Any]:
    """Return records (pairs,) at rest."""
    records = np.zeros(len(couplings), record_type(ContourRecord))
    store(records, [ContourRecord(coupling, at_rest(), math.nan) for coupling in couplings])
    return records


@kernel
def couple_axes(contours: Any, axes: Any, reference: Array, columns: int, led: bool) -> None:
    """Set the velocity offset of the samples of all coupled axes, given their inputs of this cycle.

    `reference`: see `axis_step.step_axes`, with `columns` numbers an axis.
    """
    for number in range(len(contours)):
        contour = contours[number]
        pair = read(contour["axes"], Coupling)
        first, second = axes[pair.first], axes[pair.second]
        state, contour["error_m"] = at_rest(), math.nan
        if led and first["engaged"] and second["engaged"]:
            x, y = pair.first * columns, pair.second * columns
            state, contour["error_m"] = coupled(
                pair.law,
                read(contour["state"], State),
                Pair(loop_error_m(first, reference[x]), loop_error_m(second, reference[y])),
                Pair(reference[x + 1], reference[y + 1]),
                Pair(reference[x + 2], reference[y + 2]),
            )
        write(contour["state"], state)
        first["law"]["sample"]["velocity_offset_m_s"] = state.offset_m_s.first
        second["law"]["sample"]["velocity_offset_m_s"] = state.offset_m_s.second


@kernel
def loop_error_m(axis: Any, command_m: float) -> float:
    """Command - feedback of the axis's position loop, with the correction of its last command, m."""
    inputs = axis["inputs"]
    error_m: float = command_m - inputs["scale_m"]
    if not axis["law"]["params"]["position_loop"]["scale_feedback"]:
        error_m = command_m - inputs["motor_m"] + axis["correction_m"]
    return error_m
