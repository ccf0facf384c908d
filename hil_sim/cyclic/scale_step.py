"""The tick of the linear scales: writes counts and speed of the heads to their objects."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.jit import kernel
from kernels.record_layout import record_type

SPEED_UNIT_M_S = 1e-5  # 0.01 mm/s
LARGEST_I16 = 32767


class ScaleRecord(NamedTuple):
    """One scale beside its objects. Its position in counts: those of the head times `sign`, plus `offset`."""

    axis: int = 0
    """Index of the axis in the plant."""
    carried: bool = False
    """The head measures the mass of a structural mode."""
    mark: int = 0
    """Counts of the head at the reference mark."""
    raw: int = 0
    """Counts of the head at the last reading."""
    sign: int = 1
    offset: int = 0
    frozen: bool = False
    """The head has stopped reading."""


def scale_records(count: int) -> NDArray[Any]:
    """Return records (count,) of scales at power-up."""
    records = np.zeros(count, record_type(ScaleRecord))
    records[:] = tuple(ScaleRecord())
    return records


@kernel
def read_scales(scales: Any, objects: Any, state: Any) -> None:
    """Read all heads; `objects` (scales,) are records of their process objects."""
    for index in range(len(scales)):
        read_scale(scales[index], objects[index], state[scales[index]["axis"]])


@kernel
def read_scale(scale: Any, own: Any, state: Any) -> None:
    """Read counts and speed of one head, and passages of the reference mark."""
    if scale["frozen"]:
        return
    raw, before, mark = state["scale_counts"], scale["raw"], scale["mark"]
    if raw != before:
        if before < mark <= raw or raw < mark <= before:
            own["reference_mark_passages"] += 1
            own["position_value_at_reference_mark"] = scale["sign"] * mark + scale["offset"]
        scale["raw"] = raw
    own["position_value"] = own["position_value_channel_1"] = scale["sign"] * raw + scale["offset"]
    head_m_s = state["carried_velocity_m_s"] if scale["carried"] else state["table_velocity_m_s"]
    speed = round(scale["sign"] * head_m_s / SPEED_UNIT_M_S)
    own["speed_value_channel_1"] = max(-LARGEST_I16, min(LARGEST_I16, speed))
