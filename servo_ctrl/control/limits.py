"""Limits of the set points and of the following error."""

import math
from typing import Annotated, NamedTuple

from kernels.jit import kernel
from kernels.quantities import Quantity


class AxisLimits(NamedTuple):
    """Limits of the set points, and of the position error at which the fault policy reacts."""

    velocity_m_s: Annotated[float, Quantity("m/s", 0.0, math.inf, "of the velocity set point, > 0")]
    force_n: Annotated[float, Quantity("N", 0.0, math.inf, "of the force set point, > 0")]
    following_error_m: Annotated[float, Quantity("m", 0.0, math.inf, "of the position error, > 0")]


@kernel
def clamp(value: float, limit: float) -> float:
    """Limit `value` to +-`limit` (>= 0, same unit)."""
    return min(max(value, -limit), limit)
