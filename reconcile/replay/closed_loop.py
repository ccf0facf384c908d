"""Controller and plant in one compiled loop, for closed-loop replay.

At each sample the controller reads encoder and reference. Its force takes effect `delay` substeps later
and is held for one period (zero-order hold). Between samples hil_sim's own integrator advances the axis, so
the replay runs exactly the physics that a plant file describes.
"""

from typing import Any

import numpy as np

from hil_sim.plant.integrate import advance_axis
from kernels.arrays import Array
from kernels.jit import kernel
from reconcile.replay.controller import Controller

CURRENT_LOOP = 1
"""`setpoint.loop` of hil_sim's plant: the drive follows a current."""
FORCE, MOTOR, SCALE = 0, 1, 2
"""Columns of the result: force in N, positions in m."""


@kernel
def closed_loop(
    p: Any,
    s: Any,
    sp: Any,
    substeps: int,
    dt_s: float,
    delay: int,
    controller: Controller,
    reference_m: Array,
    reference_velocity_m_s: Array,
    injected_n: Array,
    earlier_motor_m: Array,
    earlier_force_n: float,
) -> Array:
    """Run the loop over `reference_m` (n,); return (n, 3) of force, motor and scale position at the samples.

    p, s, sp: parameters, state and set point of the axis in hil_sim; `s` is advanced in place. One sample is
    `substeps` of `dt_s`; `delay` counts substeps. `injected_n` (n,) is added to the force after its limit.
    `earlier_motor_m` (w,): motor positions before the first sample, the oldest first; `earlier_force_n`: the
    force in effect then.
    """
    n = len(reference_m)
    rows = np.empty((n, 3))
    window = controller.velocity_samples
    history_m = earlier_motor_m.copy()  # ring buffer: q[k] replaces q[k - w]
    whole, part = delay // substeps, delay % substeps
    integral_n = 0.0
    sp.loop = CURRENT_LOOP
    for k in range(n):
        motor_m = s.encoder_counts * p.encoder.resolution_m
        velocity_setpoint_m_s = (
            controller.position_gain_1_s * (reference_m[k] - motor_m)
            + controller.velocity_feedforward * reference_velocity_m_s[k]
        )
        velocity_m_s = (motor_m - history_m[k % window]) / (window * controller.sample_time_s)
        history_m[k % window] = motor_m
        error_m_s = velocity_setpoint_m_s - velocity_m_s
        next_integral_n = integral_n + controller.velocity_integral_n_m * error_m_s * controller.sample_time_s
        unlimited_n = controller.velocity_gain_n_s_m * error_m_s + next_integral_n
        limited_n = min(max(unlimited_n, -controller.force_limit_n), controller.force_limit_n)
        # anti-windup: integrate in saturation only if that leads out of it
        if limited_n == unlimited_n or (unlimited_n - limited_n) * error_m_s < 0.0:
            integral_n = next_integral_n
        rows[k, FORCE] = limited_n + injected_n[k]
        rows[k, MOTOR] = motor_m
        rows[k, SCALE] = s.scale_counts * p.scale.resolution_m
        older, newer = k - whole - 1, k - whole
        if part > 0:
            force_n = rows[older, FORCE] if older >= 0 else earlier_force_n
            sp.current_a = force_n / p.mechanics.force_constant_n_a
            advance_axis(p, s, sp, part, dt_s)
        force_n = rows[newer, FORCE] if newer >= 0 else earlier_force_n
        sp.current_a = force_n / p.mechanics.force_constant_n_a
        advance_axis(p, s, sp, substeps - part, dt_s)
    return rows
