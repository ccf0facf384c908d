"""The state of a drive from tick to tick beside its objects, shared by kernels and Python."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.record_layout import record_type

NO_CYCLIC_MODE = 0
"""`cyclic_mode` outside the cyclic modes; in one, it is the code of the mode (6060h)."""
NO_SET_POINT = 1 << 31
"""60C1h:01 after its value was used: out of range, so that the same value can be written again."""


class DriveRecord(NamedTuple):
    """One axis. User positions in counts: motor counts times a sign, plus `origin`."""

    cyclic_mode: int = NO_CYCLIC_MODE
    origin: int = 0
    """User counts where the motor counts are zero; homing moves it."""
    position: float = 0.0
    """Actual position, which does not wrap."""
    range_low: int = 0
    range_high: int = 0
    range_span: int = 0
    """Position range 607Bh and its number of counts; 0 without a range."""
    position_sign: int = 1
    velocity_sign: int = 1
    torque_sign: int = 1
    """Signs of polarity 607Eh."""
    counts_per_m: float = 0.0
    m_per_count: float = 0.0
    a_per_torque: float = 0.0
    torque_per_a: float = 0.0
    current_per_a: float = 0.0
    scale_counts_per_m: float = 0.0
    """0 without a scale."""
    carried: bool = False
    """The scale measures the mass of a structural mode."""
    negative_m: float = -math.inf
    positive_m: float = math.inf
    """Positions of the table that close the limit switches."""
    home_from_m: float = math.nan
    home_to_m: float = math.nan
    """Positions that close the home switch; NaN without one."""
    blocked_low: float = -math.inf
    blocked_high: float = math.inf
    """User counts at which the axis stopped at a switch, infinite where none blocks."""
    motor_speed: float = math.inf
    """Largest speed of the motor, counts/s, from 6080h."""
    clipped: bool = False
    """A limit of travel or speed has changed the last demand."""
    present: float = 0.0
    start: float = 0.0
    target: float = 0.0
    progress: float = 1.0
    """Interpolation within a communication cycle: see `drive_step.interpolate`."""
    outside_us: int = 0
    """Time for which the following error has been outside its window."""
    state: int = 0
    acted_state: int = -1
    """State of the power drive system, and its state when the last controlword was executed."""
    acted_controlword: int = 0
    acted_max_torque: int = 0
    acted_max_current: int = 0
    acted_positive_torque: int = 0
    acted_negative_torque: int = 0
    acted_probe_function: int = 0
    acted_physical_outputs: int = 0
    acted_bit_mask: int = 0
    """Values of these objects that are in effect."""


DRIVE_RECORD = record_type(DriveRecord)


def drive_records(count: int) -> NDArray[Any]:
    """Return records (count,) of drives at power-up."""
    records = np.zeros(count, DRIVE_RECORD)
    records[:] = tuple(DriveRecord())
    return records


def store_fields(record: Any, **values: float) -> None:
    """Store values into the fields of a record."""
    for name, value in values.items():
        record[name] = value
