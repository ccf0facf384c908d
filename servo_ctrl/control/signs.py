"""What a cycle of an axis that we lead shows of trouble; `axis.supervision` judges what lasts."""

from typing import NamedTuple

from kernels.jit import kernel

DISAGREE, AT_LIMIT, PUSHED = 1, 8, 16
"""Bits: scale and encoder are apart; the force is at its limit; the axis is pushed towards its set point."""


class SupervisionLimits(NamedTuple):
    """Limits of one axis; see `axis.supervision`. SI."""

    deviation_m: float
    force_n: float
    """Limit of the force set point."""
    current_a: float
    """Measured current that counts as the limit."""
    push_n: float
    error_m: float
    """Growth of the error of an axis that runs away."""
    velocity_m_s: float
    saturation_cycles: int
    runaway_cycles: int


@kernel
def signs(
    limits: SupervisionLimits,
    deviation_m: float,
    force_n: float,
    current_a: float,
    push_n: float,
    error_m: float,
) -> int:
    """Bits of one cycle, 0 in nearly every one; what was not measured shows nothing: NaN compares as false.

    `force_n`: the set point; `push_n`: what pushes the axis, the measured current as a force, or else the set
    point.
    """
    found = DISAGREE if abs(deviation_m) > limits.deviation_m else 0
    if abs(force_n) >= limits.force_n or abs(current_a) >= limits.current_a:
        found |= AT_LIMIT
    if abs(push_n) >= limits.push_n and push_n * error_m > 0.0:
        found |= PUSHED
    return found
