"""The measured point of an axis: the table, or the mass of `structural_mode` on it.

There the scale reads, and there an external instrument (laser interferometer) would measure.
"""

from typing import Any

from kernels.jit import kernel


@kernel
def measured_point_m(p: Any, s: Any) -> float:
    """Return the true position (m) of the measured point from the machine's zero, for one axis."""
    return float(s.carried_position_m if p.structural_mode.enabled else s.table_position_m)


def velocity_field(p: Any) -> str:
    """Return the name of the AXIS_STATE field with the measured point's velocity, for one AXIS_PARAMS."""
    return "carried_velocity_m_s" if p["structural_mode"]["enabled"] else "table_velocity_m_s"
