"""The measured point of an axis: where the scale reads, and a laser interferometer would.

It is the table, or the mass of `structural_mode` that the table carries.
"""

from typing import Any

from kernels.jit import kernel


@kernel
def measured_point_m(p: Any, s: Any) -> float:
    """True position (m) of the measured point from the machine's zero, of one AXIS_PARAMS and AXIS_STATE."""
    return float(s.carried_position_m if p.structural_mode.enabled else s.table_position_m)


def velocity_field(p: Any) -> str:
    """Name of the field of AXIS_STATE that is the measured point's velocity, of one AXIS_PARAMS."""
    return "carried_velocity_m_s" if p["structural_mode"]["enabled"] else "table_velocity_m_s"
