"""Amplifier: current loop, and its velocity and position loops in CSV, CSP and the profile modes.

All loops run at every substep (20 kHz). Gains of the outer loops are in linear units (N s/m, N/m, 1/s), like
the controller's, for comparison. Symbols: Kf force constant N/A (also the back-EMF in V s/m), h substep s.

The current loop is one of two:
- `current_bandwidth_hz`: u = kp (i* - i) + ki int(i* - i). With kp = L w, ki = R w the closed loop is a
  first-order lag of bandwidth w, once the integral part equals the back-EMF. Back-calculation limits the
  integral part at the voltage limit.
- `current_gain_v_a`: Xia et al., equations (2) and (3), u = Kcp (i* - i), only proportional.
  The closed loop is also a first-order lag, of bandwidth (Kcp + R) / L, but its current settles at
  (Kcp i* - Ke v) / (Kcp + R). Their velocity loop i* = Kvp (Vc - theta') is `velocity_gain_n_s_m` =
  Kvp Kt (2 pi / lead)^2 without an integral part.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.motor import winding
from kernels.jit import kernel
from kernels.quantities import Quantity

OFF, CURRENT, VELOCITY, POSITION = 0, 1, 2, 3
"""Values of SETPOINT["loop"]: the outermost closed loop."""
SPEED_MIN_M_S = 1e-15
"""A lower speed becomes 0: denormal numbers slow the kernel down tenfold (measured). Far below any count."""


class Params(NamedTuple):
    """Limits and gains of the amplifier; exactly one parameter of the current loop is above 0."""

    voltage_limit_v: Annotated[float, Quantity("V", 1.0, 2e3, "largest winding voltage")]
    peak_current_a: Annotated[float, Quantity("A", 1e-3, 1e4, "largest current")]
    position_gain_1_s: Annotated[float, Quantity("1/s", 0.0, 1e4, "position loop gain")]
    velocity_gain_n_s_m: Annotated[float, Quantity("N s/m", 0.0, 1e8, "velocity loop gain")]
    velocity_integral_n_m: Annotated[float, Quantity("N/m", 0.0, 1e10, "integral gain of the velocity loop")]
    velocity_feedforward: Annotated[float, Quantity("", 0.0, 2.0, "feedforward gain of the position slope")]
    velocity_filter_hz: Annotated[
        float, Quantity("Hz", 1.0, 1e6, "corner frequency of the velocity estimate")
    ]
    current_bandwidth_hz: Annotated[float, Quantity("Hz", 1.0, 5e3, "bandwidth of the current loop")] = 0.0
    current_gain_v_a: Annotated[
        float, Quantity("V/A", 1e-3, 1e4, "gain Kcp of a proportional current loop")
    ] = 0.0


@kernel
def velocity_filter_gain(p: Any, dt_s: float) -> float:
    """Return the share of a new difference in the velocity estimate: backward Euler over a substep."""
    w_dt = 2.0 * math.pi * p.velocity_filter_hz * dt_s
    return float(w_dt / (1.0 + w_dt))


@kernel
def estimate_velocity(s: Any, resolution_m: float, counts: int, filter_gain: float, dt_s: float) -> None:
    """Store the encoder counts of a substep, and low-pass their difference into `s.encoder_velocity_m_s`."""
    raw_m_s = (counts - s.encoder_counts) * resolution_m / dt_s
    estimate_m_s = s.encoder_velocity_m_s + filter_gain * (raw_m_s - s.encoder_velocity_m_s)
    s.encoder_velocity_m_s = estimate_m_s if abs(estimate_m_s) > SPEED_MIN_M_S else 0.0
    s.encoder_counts = counts


@kernel
def enter_loop(s: Any, setpoint: Any, force_constant_n_a: float) -> None:
    """Change the loop: start interpolation at the new set point, and keep the force continuous."""
    s.position_setpoint_m = setpoint.position_m
    s.velocity_setpoint_m_s = setpoint.velocity_m_s
    if setpoint.loop <= CURRENT or s.loop <= CURRENT:
        s.velocity_integral_n = s.current_a * force_constant_n_a
    if setpoint.loop == OFF:
        s.current_a = 0.0
        s.current_integral_v = 0.0
        s.voltage_v = 0.0
        s.velocity_integral_n = 0.0
    s.loop = setpoint.loop


@kernel
def current_reference_a(
    p: Any,
    s: Any,
    setpoint: Any,
    resolution_m: float,
    force_constant_n_a: float,
    fraction: float,
    dt_s: float,
    span_s: float,
) -> float:
    """Return the current set point (A) of the active loop after `fraction` (0..1] of the call.

    `span_s` is the duration of the call, over which position and velocity set points are interpolated.
    """
    limit_a = min(setpoint.current_limit_a, p.peak_current_a)
    high_a = limit_a - setpoint.limit_reduction_positive_a
    low_a = setpoint.limit_reduction_negative_a - limit_a
    if setpoint.loop == CURRENT:
        return float(max(low_a, min(high_a, setpoint.current_a + setpoint.current_offset_a)))
    velocity_m_s = setpoint.velocity_offset_m_s
    if setpoint.loop == POSITION:
        step_m = setpoint.position_m - s.position_setpoint_m
        error_m = s.position_setpoint_m + fraction * step_m - s.encoder_counts * resolution_m
        velocity_m_s += p.position_gain_1_s * error_m + p.velocity_feedforward * step_m / span_s
    else:
        velocity_m_s += s.velocity_setpoint_m_s + fraction * (setpoint.velocity_m_s - s.velocity_setpoint_m_s)
    error_m_s = velocity_m_s - s.encoder_velocity_m_s
    integral_n = s.velocity_integral_n + p.velocity_integral_n_m * error_m_s * dt_s
    unlimited_a = (
        p.velocity_gain_n_s_m * error_m_s + integral_n
    ) / force_constant_n_a + setpoint.current_offset_a
    limited_a = max(low_a, min(high_a, unlimited_a))
    # conditional integration: at the limit the integral part changes only away from it
    if limited_a == unlimited_a or (unlimited_a - limited_a) * error_m_s < 0.0:
        s.velocity_integral_n = integral_n
    return float(limited_a)


@kernel
def drive_current(
    p: Any, p_winding: Any, s: Any, reference_a: float, back_emf_v: float, decay: float, dt_s: float
) -> None:
    """Advance current loop and winding by a substep; without a winding the current is the reference.

    `decay`: `winding.decay` of the substep.
    """
    if p_winding.enabled == 0:
        s.current_a = reference_a
        return
    if p.current_gain_v_a > 0.0:
        unlimited_v = p.current_gain_v_a * (reference_a - s.current_a)
        s.voltage_v = max(-p.voltage_limit_v, min(p.voltage_limit_v, unlimited_v))
        s.current_a = winding.current_a(p_winding, s.current_a, s.voltage_v, back_emf_v, decay)
        return
    bandwidth_1_s = 2.0 * math.pi * p.current_bandwidth_hz
    proportional_v_a = p_winding.inductance_h * bandwidth_1_s
    integral_gain_v_a = p_winding.resistance_v_a * bandwidth_1_s * dt_s
    error_a = reference_a - s.current_a
    unlimited_v = proportional_v_a * error_a + s.current_integral_v
    s.voltage_v = max(-p.voltage_limit_v, min(p.voltage_limit_v, unlimited_v))
    s.current_integral_v += integral_gain_v_a * (error_a + (s.voltage_v - unlimited_v) / proportional_v_a)
    s.current_a = winding.current_a(p_winding, s.current_a, s.voltage_v, back_emf_v, decay)
