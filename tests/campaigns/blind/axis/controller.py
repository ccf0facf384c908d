"""The sampled controller: P-PI, or PID with a filtered D; its integral stops at the force limit."""

import math
from typing import NamedTuple

from tests.campaigns.blind.arrays import Array
from tests.campaigns.blind.compiled import compiled
from tests.campaigns.blind.plant import Loop


class ControllerState(NamedTuple):
    """Kept from sample to sample."""

    integral_n: float
    rate_m_s: float
    """Filtered velocity of the encoder."""
    encoder_m: float


@compiled
def command_n(
    c: Loop, state: ControllerState, set_point: Array, encoder_m: float, scale_m: float, period_s: float
) -> tuple[float, ControllerState]:
    """Return the force command. `set_point` (3,): position, velocity, acceleration, SI."""
    integral = state.integral_n
    keep = math.exp(-2.0 * math.pi * c.filter_hz * period_s)
    rate = keep * state.rate_m_s + (1.0 - keep) * (encoder_m - state.encoder_m) / period_s
    error = set_point[0] - (scale_m if c.on_scale > 0.0 else encoder_m)
    feedforward = c.mass_feedforward_kg * set_point[2] + c.viscous_feedforward_n_s_m * set_point[1]
    if c.cascade > 0.0:
        error = set_point[1] + c.kp * error - rate
        command = c.kd * error + integral + feedforward
    else:
        command = c.kp * error + integral + c.kd * (set_point[1] - rate) + feedforward
    if abs(command) < c.force_limit_n:
        integral += c.ki * error * period_s
    command = min(max(command, -c.force_limit_n), c.force_limit_n)
    return command, ControllerState(integral, rate, encoder_m)
