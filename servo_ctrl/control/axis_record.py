"""The tick over records, for the daemon: an axis lies in memory from tick to tick, one call takes all axes.

It calls the same `axis_tick` as the batch twin, so the bits are the same. A record has the fields of
`AxisRecord`; the tables of its parameters lie in a pool beside the records.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.jit import kernel
from kernels.records import Pool, read, record_type, store, write
from servo_ctrl.control.tick import AxisParams, AxisState, axis_tick, initial_state
from servo_ctrl.control.types import AxisCommand, AxisSample


class AxisRecord(NamedTuple):
    """What lies in memory of one axis."""

    params: AxisParams
    state: AxisState
    sample: AxisSample
    command: AxisCommand


def axis_records(
    params: Sequence[AxisParams], motor_position_m: Sequence[float]
) -> tuple[NDArray[Any], Pool]:
    """Records (n,) of axes at rest at these positions (metres), and the pool of their tables."""
    axes = np.zeros(len(params), record_type(AxisRecord))
    store(axes["state"], [initial_state(position_m) for position_m in motor_position_m])
    return axes, store(axes["params"], params)


@kernel
def tick_axes(axes: Any, tables: Pool) -> None:
    """One `axis_tick` of each axis: its parameters and its sample, into its state and its command."""
    for axis in axes:
        params, sample = read(axis["params"], AxisParams, tables), read(axis["sample"], AxisSample)
        state, command = axis_tick(params, read(axis["state"], AxisState), sample)
        write(axis["state"], state)
        write(axis["command"], command)
