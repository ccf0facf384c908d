"""The tick over a record: what the law of an axis works on lies in memory from tick to tick.

A record has the fields of `AxisRecord`; the tables of its parameters lie in a pool beside the records. The
daemon's cycle (`cyclic.axis_step`) has one in the record of each axis.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.jit import kernel
from kernels.records import Pool, read, record_type, store, write
from servo_ctrl.control.set_point_counts import SetPointCounts, SetPointUnits, set_point_counts
from servo_ctrl.control.signs import SupervisionLimits, signs
from servo_ctrl.control.tick import AxisParams, AxisState, axis_tick, initial_state
from servo_ctrl.control.types import AxisCommand, AxisSample


class AxisRecord(NamedTuple):
    """What lies in memory of the law of one axis."""

    params: AxisParams
    units: SetPointUnits
    limits: SupervisionLimits
    state: AxisState
    sample: AxisSample
    current_a: float
    """Measured, NaN where it is not."""
    command: AxisCommand
    counts: SetPointCounts
    signs: int
    """Of `control.signs`."""


SI = SetPointUnits(1.0, 1.0, 1.0, offset_apart=True, velocity_offset=True)


def axis_records(
    params: Sequence[AxisParams],
    motor_position_m: Sequence[float],
    units: Sequence[SetPointUnits] = (),
    limits: Sequence[SupervisionLimits] = (),
) -> tuple[NDArray[Any], Pool]:
    """Records (n,) of axes at rest at these positions (metres), and the pool of their tables.

    Without units a count is a newton or a metre, without limits the signs mean nothing.
    """
    axes = np.zeros(len(params), record_type(AxisRecord))
    store(axes["state"], [initial_state(position_m) for position_m in motor_position_m])
    store(axes["units"], units or [SI] * len(params))
    store(axes["limits"], limits)
    return axes, store(axes["params"], params)


@kernel
def tick_axis(axis: Any, tables: Pool) -> None:
    """One `axis_tick`: the axis' parameters and its sample, into its state and what it commands."""
    params, sample = read(axis["params"], AxisParams, tables), read(axis["sample"], AxisSample)
    state, command = axis_tick(params, read(axis["state"], AxisState), sample)
    write(axis["state"], state)
    write(axis["command"], command)
    counts = set_point_counts(
        read(axis["units"], SetPointUnits),
        params.feedforward.velocity,
        command,
        sample.velocity_command_m_s,
    )
    write(axis["counts"], counts)
    measured_n = sample.motor_force_n
    axis["signs"] = signs(
        read(axis["limits"], SupervisionLimits),
        sample.motor_position_m - command.correction_m - sample.scale_position_m,
        command.force_n,
        axis["current_a"],
        command.force_n if math.isnan(measured_n) else measured_n,
        command.position_error_m,
    )
