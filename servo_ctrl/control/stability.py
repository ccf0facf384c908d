"""Decides whether a loop is stable, from its frequency response: Nyquist's criterion, once for all loops.

The characteristic 1 + L(z), or a quotient of two of them, has as many zeros as poles. On the unit circle from
z = 1 to z = -1 its angle turns by pi / 2 for each integrator, and by pi less for each zero that is outside.
If its other poles are inside, the loop is hence stable if the angle ends at 0, counted from where the
integrators start: -pi / 2 each (Franklin, Powell and Workman, Digital Control of Dynamic Systems, section
7.5). `tests/unit/servo_control/test_stability.py` holds it against eigenvalues of models in state space.
"""

import math

from kernels.jit import kernel
from servo_ctrl.control.axis_loop import Response

START_DEVIATION_RAD = 0.75 * math.pi
"""Largest deviation of the first angle from that of the integrators; chosen: viscous friction takes away half
a turn of an integrator where the grid begins, and a negative gain adds a whole half turn."""


@kernel
def is_stable(characteristic: Response, integrators: int) -> bool:
    """Whether all zeros of the characteristic are inside the unit circle.

    `characteristic`: (n,), at ascending frequencies up to half the sampling rate, which begin where the
    integrators dominate and are dense enough not to miss a turn. `integrators`: its poles at z = 1.
    """
    at = characteristic[0]
    from_start = -0.5 * math.pi * integrators - math.atan2(at.imag, at.real)
    turns = round(from_start / (2.0 * math.pi))
    if abs(from_start - 2.0 * math.pi * turns) > START_DEVIATION_RAD:
        return False
    for k in range(1, len(characteristic)):
        before, at = at, characteristic[k]
        if (at.imag < 0.0) != (before.imag < 0.0):
            left = before.real * at.imag - at.real * before.imag  # it crosses the axis left of 0, by its sign
            if left * (at.imag - before.imag) < 0.0:
                turns += 1 if at.imag < 0.0 else -1
    return turns == 0 and at.real > 0.0
