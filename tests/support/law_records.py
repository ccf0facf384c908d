"""Records of the control law for tests, without a cycle around them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.record_layout import Pool, record_type, store
from servo_ctrl.control.axis_record import AxisRecord
from servo_ctrl.control.set_point_counts import SetPointUnits
from servo_ctrl.control.tick import AxisParams, initial_state

SI = SetPointUnits(1.0, 1.0, 1.0, offset_apart=True, velocity_offset=True)


def axis_records(
    params: Sequence[AxisParams], motor_position_m: Sequence[float]
) -> tuple[NDArray[Any], Pool]:
    """Make the records (n,) of axes at rest at these positions (m), and the pool of their tables.

    A count is a newton or a metre, and `signs` has no meaning, because the supervision limits are 0.
    """
    axes = np.zeros(len(params), record_type(AxisRecord))
    store(axes["state"], [initial_state(position_m) for position_m in motor_position_m])
    store(axes["units"], [SI] * len(params))
    return axes, store(axes["params"], params)
