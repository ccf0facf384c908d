"""From command to motor force: delay, dead zone, current loop, voltage, saturation, ripple, cogging."""

import math
from typing import NamedTuple

from tests.campaigns.blind.arrays import Array
from tests.campaigns.blind.compiled import compiled
from tests.campaigns.blind.nonlinearities import wave
from tests.campaigns.blind.plant import Plant


class CurrentLoopState(NamedTuple):
    """Current of the second-order loop, as a force, and its rate."""

    current_n: float
    rate_n_s: float


class DriveForce(NamedTuple):
    """The force after each cause in turn, newtons."""

    command_n: float
    after_dead_zone_n: float
    current_n: float
    """After the current loop."""
    limited_n: float
    """By the voltage."""
    developed_n: float
    """By saturated iron."""
    torque_ratio: float
    """Torque over its mean at this place of the turn."""
    force_n: float


@compiled
def delayed_n(
    p: Plant, commands_n: Array, sample: int, sample_s: float, now_s: float, period_s: float
) -> float:
    """Return the command that acts now, of those up to `sample`, whose period began at `sample_s`."""
    delay = p.delay_after_step_s if sample_s >= p.delay_step_at_s else p.delay_s
    acting = int((now_s - delay) / period_s) if now_s >= delay else 0
    held: float = commands_n[min(acting, sample)]
    return held


@compiled
def drive_force(
    p: Plant, state: CurrentLoopState, command_n: float, turn_m: float, motor_m_s: float, h: float
) -> tuple[DriveForce, CurrentLoopState]:
    """Return the force of a delayed command after `h` seconds; `turn_m` is the place on the screw."""
    after_dead_zone = command_n
    if p.dead_zone_n > 0.0:
        w2 = p.dead_zone_rounding_n**2
        after_dead_zone += 0.5 * (
            math.sqrt((command_n - p.dead_zone_n) ** 2 + w2)
            - math.sqrt((command_n + p.dead_zone_n) ** 2 + w2)
        )
    loop_n, rate = state
    current = after_dead_zone
    if p.current_loop_rad_s > 0.0:
        rate += h * (
            p.current_loop_rad_s**2 * (after_dead_zone - loop_n)
            - 2.0 * p.current_loop_damping * p.current_loop_rad_s * rate
        )
        loop_n += h * rate
        current = loop_n
    limited = current
    if p.stall_n > 0.0:
        upper = max(p.stall_n * (1.0 - motor_m_s / p.no_load_m_s), 0.0)
        lower = min(-p.stall_n * (1.0 + motor_m_s / p.no_load_m_s), 0.0)
        limited = min(max(current, lower), upper)
    developed = limited
    if p.saturation_n > 0.0:
        developed = p.saturation_n * math.atan(limited / p.saturation_n)
    ratio = 1.0 + p.torque_ripple * wave(
        p.torque_ripple_1_m * turn_m + p.torque_ripple_phase_rad, p.torque_ripple_skew
    )
    force = DriveForce(command_n, after_dead_zone, current, limited, developed, ratio, developed * ratio)
    return force, CurrentLoopState(loop_n, rate)


@compiled
def cogging_n(p: Plant, turn_m: float) -> float:
    """Return the cogging force."""
    force: float = p.cogging_n * wave(p.cogging_1_m * turn_m + p.cogging_phase_rad, p.cogging_skew)
    return force


@compiled
def clutter_n(p: Plant, turn_m: float) -> float:
    """Return the cogging of another pitch, which every axis has."""
    return p.clutter_n * math.sin(p.clutter_1_m * turn_m + p.clutter_phase_rad)
