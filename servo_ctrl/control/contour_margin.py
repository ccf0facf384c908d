"""Robustness of two axes that contour control couples, for all directions of the path.

Along a straight path with the normal n the coupling is linear, with W(z) = kp_c + ki_c T / (1 - 1/z). The
open loop of both axes is diag(L_x, L_y) + diag(G_x, G_y) W n n', with L open at the set points of the
amplifiers and G = dL / dkp: measured, or of a rigid mass. Ms is the largest singular value of its sensitivity
at any frequency, in any direction (Skogestad and Postlethwaite, Multivariable Feedback Control, sections 3.3
and 9.2). For equal axes it is that of one axis with kp + kp_c beside the path, and with kp along it. As the
coupling is of rank one, two stable loops stay stable if 1 + W n' diag(G / (1 + L)) n does not go round 0
(Nyquist).
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from kernels.jit import kernel
from servo_ctrl.control.contour_control import Params
from servo_ctrl.control.loop_margins import Response, all_frequencies_hz, open_loop
from servo_ctrl.control.tick import AxisParams

ANGLES_RAD = np.linspace(0.0, 0.5 * math.pi, 13)
"""Directions of the path; the others are mirrored ones, which have the same singular values."""


class CoupledLoop(NamedTuple):
    """What the coupling meets in one axis, (n,) each."""

    loop: Response
    """L."""
    per_gain: Response
    """G: how L grows with the gain of the position loop, s."""


LoopPair = tuple[CoupledLoop, CoupledLoop]


def coupled_sensitivity_peak(
    contour: Params, first: AxisParams, second: AxisParams, first_kg: float, second_kg: float
) -> float:
    """Return Ms of two coupled axes with these masses; infinite where the coupling makes them unstable."""
    frequency_hz = all_frequencies_hz(contour.period_s)
    pair = rigid_loop(first, first_kg, frequency_hz), rigid_loop(second, second_kg, frequency_hz)
    return pair_sensitivity_peak(pair, contour_law(contour, frequency_hz))


def contour_law(contour: Params, frequency_hz: Array) -> Response:
    """Return W, velocity per contour error, 1/s, (n,)."""
    z = np.exp(2j * math.pi * frequency_hz * contour.period_s)
    return np.asarray(contour.kp_1_s + contour.ki_1_s2 * contour.period_s / (1.0 - 1.0 / z))


def rigid_loop(params: AxisParams, mass_kg: float, frequency_hz: Array) -> CoupledLoop:
    """Return the loop of an axis on a rigid mass; L is linear in the gain of the position loop."""
    position = params.position_loop
    more = params._replace(position_loop=position._replace(kp_1_s=position.kp_1_s + 1.0))
    loop = open_loop(params, mass_kg, frequency_hz)
    return CoupledLoop(loop, np.asarray(open_loop(more, mass_kg, frequency_hz) - loop))


def pair_sensitivity_peak(pair: LoopPair, law: Response) -> float:
    """Return Ms of two axes, each of them stable alone; infinite where the coupling makes them unstable.

    `law`: W on the ascending frequencies of both loops, (n,), up to half the sampling rate.
    """
    return max(direction_peak(*pair, law, angle_rad) for angle_rad in ANGLES_RAD.tolist())


@kernel
def direction_peak(first: CoupledLoop, second: CoupledLoop, law: Response, angle_rad: float) -> float:
    """Return Ms for one direction of the path, likewise."""
    n1, n2 = -math.sin(angle_rad), math.cos(angle_rad)
    peak, turns, previous = 0.0, 0, 1.0 + 0.0j
    for k in range(len(law)):
        own, other = 1.0 + first.loop[k], 1.0 + second.loop[k]
        added, added_other = first.per_gain[k] * law[k], second.per_gain[k] * law[k]
        a, b = own + n1 * n1 * added, n1 * n2 * added
        c, d = n1 * n2 * added_other, other + n2 * n2 * added_other
        peak = max(peak, largest_of_inverse(a, b, c, d))
        # as the quotient of two determinants, of which only the angle counts: 1 + W n' diag(G / (1 + L)) n
        around = (a * d - b * c) * (own * other).conjugate()
        if (around.imag < 0.0) != (previous.imag < 0.0):
            left = previous.real * around.imag - around.real * previous.imag  # of 0, by its sign
            if left * (around.imag - previous.imag) < 0.0:
                turns += 1 if around.imag < 0.0 else -1
        previous = around
    # half the sampling rate is on the real axis
    return math.inf if turns != 0 or previous.real < 0.0 else peak


@kernel
def largest_of_inverse(a: complex, b: complex, c: complex, d: complex) -> float:
    """Return the largest singular value of the inverse of [[a, b], [c, d]]: 1 over its own least one."""
    squares = power(a) + power(b) + power(c) + power(d)
    determinant = power(a * d - b * c)
    largest = 0.5 * (squares + math.sqrt(max(squares * squares - 4.0 * determinant, 0.0)))
    return math.sqrt(largest / determinant)


@kernel
def power(value: complex) -> float:
    """Return the square of the absolute value, without the square root of `abs`."""
    return value.real * value.real + value.imag * value.imag
