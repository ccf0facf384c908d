"""Disturbance observer: force that the nominal model cannot account for (Feng et al. 2015, section 2).

    d = Q [ u - (M a + B v) ],   added to the force command

u is the measured force (current times force constant), a and v come from the motor encoder, and Q is a
first-order low pass. The nominal model's inverse asks for M a + B v; what was needed beyond it is friction
and whatever else acts on the axis.

a[k] = (v[k] - v[k-1]) / T spans the last two periods, and so does the mean of the last two currents.

The first velocity after a gap spans the gap. What is not to be used is NaN in the state.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from servo_ctrl.control.jit import kernel
from servo_ctrl.control.types import ObserverState

if TYPE_CHECKING:
    from servo_ctrl.control.params import DisturbanceObserver


@kernel
def observed_disturbance(
    p: DisturbanceObserver,
    state: ObserverState,
    motor_force_n: float,
    velocity_m_s: float,
    period_s: float,
) -> ObserverState:
    """The estimate one period later; it rests while the force is absent (NaN) or the velocity spans a gap."""
    if not p.enabled or not math.isfinite(motor_force_n):
        return ObserverState(0.0 if not p.enabled else state.disturbance_n, velocity_m_s, motor_force_n)
    if not math.isfinite(state.velocity_m_s):
        return ObserverState(state.disturbance_n, velocity_m_s, math.nan)
    if not math.isfinite(state.motor_force_n):
        return ObserverState(state.disturbance_n, velocity_m_s, motor_force_n)
    force_n = 0.5 * (motor_force_n + state.motor_force_n)
    middle_m_s = 0.5 * (velocity_m_s + state.velocity_m_s)
    model_n = p.mass_kg * (velocity_m_s - state.velocity_m_s) / period_s + p.viscous_n_s_m * middle_m_s
    disturbance_n = state.disturbance_n + p.filter_blend * (force_n - model_n - state.disturbance_n)
    return ObserverState(disturbance_n, velocity_m_s, motor_force_n)
