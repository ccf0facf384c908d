"""The force of the learned waveform along a whole motion, for rivals that plan it in advance."""

import math

import numpy as np

from kernels.arrays import Array
from kernels.jit import kernel
from servo_ctrl.control.compensation import learned_waveform, trapezoidal_pulse
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.control.types import AxisSample


def force_along(params: AxisParams, commands: Array) -> Array:
    """Return the force (n,), newtons, along the commands (n, >= 3) of one axis, which start at standstill.

    Columns of the commands: position m, velocity m/s, acceleration m/s^2.
    """
    return _along(params, np.ascontiguousarray(commands[:, :3], np.float64))


@kernel
def _along(params: AxisParams, commands: Array) -> Array:
    pulse = trapezoidal_pulse.at_rest(commands[0, 0])
    state = learned_waveform.at_rest(commands[0, 0])
    force_n = np.zeros(len(commands))
    for k in range(len(commands)):
        sample = AxisSample(
            commands[k, 0], commands[k, 1], commands[k, 2], 0.0, math.nan, math.nan, math.nan, 0.0
        )
        pulse = trapezoidal_pulse.advance_pulse(params.pulse, pulse, sample, params.period_s)
        force_n[k], state = learned_waveform.planned_force(
            params.waveform, state, pulse, sample, params.period_s
        )
    return force_n
