"""The learned force of the control law along a whole motion, for rivals that plan it."""

import numpy as np

from kernels.arrays import Array
from kernels.jit import kernel
from servo_ctrl.control.compensation.learned_waveform import Params, at_rest, planned_force
from servo_ctrl.control.compensation.trapezoidal_pulse import REST_M
from servo_ctrl.control.tick import AxisParams


def force_along(params: AxisParams, commands: Array) -> Array:
    """The force (n,) for the commands (n, >= 3) of one axis, at rest before the first.

    Position m, velocity m/s, acceleration m/s^2.
    """
    return _along(params.waveform, np.ascontiguousarray(commands[:, :3], np.float64), params.period_s)


@kernel
def _along(params: Params, commands: Array, period_s: float) -> Array:
    state, direction, age_s = at_rest(commands[0, 0]), 0.0, 0.0
    force_n = np.zeros(len(commands))
    for k in range(len(commands)):
        increment_m = commands[k, 0] - commands[k - 1, 0] if k else 0.0
        age_s += period_s
        if abs(increment_m) >= REST_M:
            now = 1.0 if increment_m > 0.0 else -1.0
            if now * direction < 0.0:
                age_s = 0.0
            direction = now
        force_n[k], state = planned_force(
            params, state, direction, age_s, commands[k, 0], commands[k, 1], commands[k, 2], period_s
        )
    return force_n
