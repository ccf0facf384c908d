"""Bounds of set points."""

import math
from typing import Annotated, NamedTuple

from kernels.jit import kernel
from kernels.quantities import Quantity


class AxisLimits(NamedTuple):
    """Bounds of the commands and of the position error."""

    velocity_m_s: Annotated[float, Quantity("m/s", 0.0, math.inf, "of the velocity set point, > 0")]
    force_n: Annotated[float, Quantity("N", 0.0, math.inf, "of the force set point, > 0")]
    following_error_m: Annotated[float, Quantity("m", 0.0, math.inf, "of the position error, > 0")]


@kernel
def clamp(value: float, limit: float) -> float:
    """`value` within +-`limit` (limit >= 0, same unit)."""
    return min(max(value, -limit), limit)
