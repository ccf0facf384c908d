"""Controller and plant in one compiled loop: what the replay runs.

At each sample the controller reads the encoder and the reference; its force acts from `delay` substeps later
on and is held for a period. In between hil_sim's own kernel advances the axis: what stands in a plant file is
what is replayed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numba
import numpy as np

from hil_sim.plant.integrate import advance_axis

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from reconcile.replay_controller import Controller

    Array = NDArray[np.float64]

CURRENT_LOOP = 1
ROWS = ("force_n", "motor_m", "scale_m")


@numba.njit(error_model="numpy")  # not cached on disk: numba would not see a change in hil_sim's kernels
def closed_loop(
    p: Any,
    s: Any,
    sp: Any,
    substeps: int,
    dt_s: float,
    delay: int,
    controller: Controller,
    reference_m: Array,
    feedforward_m_s: Array,
    injected_n: Array,
    before_m: Array,
    before_n: float,
) -> Array:
    """Rows (n, 3), see ROWS, at the samples of `reference_m` (n,).

    `before_m`: motor positions of the w samples before the first, the oldest first; `before_n`: the force in
    effect then. `injected_n` is added to the force behind its limit. `s` is advanced in place.
    """
    n = len(reference_m)
    rows = np.empty((n, 3))
    window = controller.velocity_samples
    history_m = before_m.copy()  # q[k - w] lies where q[k] goes
    whole, part = delay // substeps, delay % substeps
    integral_n = 0.0
    sp.loop = CURRENT_LOOP
    for k in range(n):
        motor_m = s.encoder_counts * p.encoder.resolution_m
        wanted_m_s = (
            controller.position_gain_1_s * (reference_m[k] - motor_m)
            + controller.velocity_feedforward * feedforward_m_s[k]
        )
        velocity_m_s = (motor_m - history_m[k % window]) / (window * controller.period_s)
        history_m[k % window] = motor_m
        error_m_s = wanted_m_s - velocity_m_s
        summed_n = integral_n + controller.velocity_integral_n_m * error_m_s * controller.period_s
        free_n = controller.velocity_gain_n_s_m * error_m_s + summed_n
        limited_n = min(max(free_n, -controller.force_limit_n), controller.force_limit_n)
        if limited_n == free_n or (free_n - limited_n) * error_m_s < 0.0:
            integral_n = summed_n
        rows[k, 0] = limited_n + injected_n[k]
        rows[k, 1] = motor_m
        rows[k, 2] = s.scale_counts * p.scale.resolution_m
        older, newer = k - whole - 1, k - whole
        if part > 0:
            force_n = rows[older, 0] if older >= 0 else before_n
            sp.current_a = force_n / p.mechanics.force_constant_n_a
            advance_axis(p, s, sp, part, dt_s)
        force_n = rows[newer, 0] if newer >= 0 else before_n
        sp.current_a = force_n / p.mechanics.force_constant_n_a
        advance_axis(p, s, sp, substeps - part, dt_s)
    return rows
