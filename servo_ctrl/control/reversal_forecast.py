"""When a commanded motion reverses, from its velocity, acceleration and jerk alone.

    v* + a* t + j* t^2 / 2 = 0

A feed hold, a stop or a jog changes the forecast together with the command: the program need not be known.
"""

import math

from kernels.jit import kernel


@kernel
def forecast(
    direction: float, velocity_m_s: float, acceleration_m_s2: float, jerk_m_s3: float
) -> tuple[float, float]:
    """Time until the motion in `direction` (+1 or -1) reverses, s, and its deceleration then, m/s^2.

    The time is negative just after the reversal, and NaN if none is foreseen.
    """
    speed_m_s, braking_m_s2, growth_m_s3 = (
        direction * velocity_m_s,
        -direction * acceleration_m_s2,
        -direction * jerk_m_s3,
    )
    if speed_m_s < 0.0 < braking_m_s2:  # reversed since the last sample
        return speed_m_s / braking_m_s2, braking_m_s2
    square = braking_m_s2 * braking_m_s2 + 2.0 * growth_m_s3 * speed_m_s
    if not speed_m_s > 0.0 or not square > 0.0:
        return math.nan, 0.0
    reverse_m_s2 = math.sqrt(square)
    if not braking_m_s2 + reverse_m_s2 > 0.0:
        return math.nan, 0.0
    return 2.0 * speed_m_s / (braking_m_s2 + reverse_m_s2), reverse_m_s2


@kernel
def reversal_between_samples(
    direction: float, position_m: float, velocity_m_s: float, acceleration_m_s2: float, period_s: float
) -> float:
    """Position of the reversal, m, from the first sample of the new direction."""
    speed_m_s, gain_m_s2 = direction * velocity_m_s, direction * acceleration_m_s2
    since_s = speed_m_s / gain_m_s2 if speed_m_s > 0.0 and gain_m_s2 > 0.0 else 0.0
    since_s = min(since_s, 2.0 * period_s)
    return position_m - direction * 0.5 * gain_m_s2 * since_s * since_s
