"""Saturation of set points."""

from kernels.jit import kernel


@kernel
def clamp(value: float, limit: float) -> float:
    """`value` within +-`limit` (limit >= 0, same unit)."""
    return min(max(value, -limit), limit)
