"""Signs of trouble in one cycle of a commanded axis; `axis.supervision` judges how long they last."""

from typing import NamedTuple

from kernels.jit import kernel

DISAGREE, AT_LIMIT, PUSHED = 1, 8, 16
"""Bits: scale and encoder disagree; force at its limit; force pushes the axis towards its set point."""


class SupervisionLimits(NamedTuple):
    """Limits of one axis, SI; see `axis.supervision`."""

    deviation_m: float
    """Largest difference between motor encoder and scale."""
    force_n: float
    """Limit of the force set point."""
    current_a: float
    """Measured current that counts as being at the limit."""
    push_n: float
    """Force from which the axis counts as pushed."""
    error_m: float
    """Growth of the position error by which an axis runs away."""
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
    """Bits of one cycle, usually 0. An absent value (NaN) sets no bit, because it compares as false.

    `force_n`: the set point; `push_n`: the force from the measured current, or else the set point.
    """
    bits = DISAGREE if abs(deviation_m) > limits.deviation_m else 0
    if abs(force_n) >= limits.force_n or abs(current_a) >= limits.current_a:
        bits |= AT_LIMIT
    if abs(push_n) >= limits.push_n and push_n * error_m > 0.0:
        bits |= PUSHED
    return bits
