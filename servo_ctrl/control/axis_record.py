"""The tick on a record in memory: parameters, state, sample and command of one axis stay in place.

A record has the fields of `AxisRecord`; the tables of its parameters lie in a pool beside the records. The
daemon's cycle (`cyclic.axis_step`) has one such record per axis.
"""

import math
from typing import Any, NamedTuple

from kernels.jit import kernel
from kernels.record_layout import Pool
from kernels.records import read, write
from servo_ctrl.control.set_point_counts import SetPointCounts, SetPointUnits, set_point_counts
from servo_ctrl.control.signs import SupervisionLimits, signs
from servo_ctrl.control.tick import AxisParams, AxisState, axis_tick
from servo_ctrl.control.types import AxisCommand, AxisSample


class AxisRecord(NamedTuple):
    """Layout of the record of one axis."""

    params: AxisParams
    units: SetPointUnits
    limits: SupervisionLimits
    state: AxisState
    sample: AxisSample
    current_a: float
    """Measured current; NaN if the drive does not send it."""
    command: AxisCommand
    counts: SetPointCounts
    signs: int
    """Bits of `control.signs`."""


@kernel
def tick_axis(axis: Any, tables: Pool) -> None:
    """Run `axis_tick` on a record: its parameters and sample determine its next state, command and counts."""
    params, sample = read(axis["params"], AxisParams, tables), read(axis["sample"], AxisSample)
    state, command = axis_tick(params, read(axis["state"], AxisState), sample)
    write(axis["state"], state)
    write(axis["command"], command)
    counts = set_point_counts(
        read(axis["units"], SetPointUnits), params.feedforward.velocity, command, sample.velocity_command_m_s
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
