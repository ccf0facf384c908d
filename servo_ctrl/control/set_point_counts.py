"""Set points as the integers of the bus: per mille of the rated torque, and encoder counts.

The daemon sends them; the batch twin passes them to the plant.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.jit import kernel
from servo_ctrl.control.types import AxisCommand

I16_MAX = 0x7FFF
I32_MAX = 0x7FFFFFFF


class SetPointUnits(NamedTuple):
    """Units of the drive's objects, and which offsets are objects of their own in its PDOs."""

    newton_per_permille: float
    metre_per_count: float
    metre_per_s_per_unit: float
    """Unit of velocities."""
    offset_apart: bool
    """The force offset is sent in 60B2h; else it is added to the force."""
    velocity_offset: bool
    """The velocity feedforward is sent in 60B1h."""


class SetPointCounts(NamedTuple):
    """Set points in the units of the drive."""

    torque: int
    torque_offset: int
    velocity: int
    position: int
    velocity_offset: int


@kernel
def whole(value: float, unit: float, largest: int) -> int:
    """Round `value` to whole multiples of `unit`, half to even, limited to +-`largest`; NaN gives 0."""
    multiple = value / unit
    if -largest <= multiple <= largest:
        return int(np.rint(multiple))
    if math.isnan(multiple):
        return 0
    return largest if multiple > 0.0 else -largest


@kernel
def set_point_counts(
    units: SetPointUnits, velocity_feedforward: float, command: AxisCommand, velocity_m_s: float
) -> SetPointCounts:
    """Convert the commands of a tick to the drive's units; `velocity_m_s`: the program's velocity command."""
    force_n, offset_n = command.force_n, command.force_offset_n
    if not units.offset_apart:
        force_n, offset_n = force_n + offset_n, 0.0
    feedforward = velocity_feedforward if units.velocity_offset else 0.0
    return SetPointCounts(
        torque=whole(force_n, units.newton_per_permille, I16_MAX),
        torque_offset=whole(offset_n, units.newton_per_permille, I16_MAX),
        velocity=whole(command.velocity_m_s, units.metre_per_s_per_unit, I32_MAX),
        position=whole(command.position_m + command.correction_m, units.metre_per_count, I32_MAX),
        velocity_offset=whole(feedforward * velocity_m_s, units.metre_per_s_per_unit, I32_MAX),
    )
