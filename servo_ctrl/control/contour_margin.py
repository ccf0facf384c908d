"""Robustness of two coupled axes on rigid masses, for all directions of the path.

Along a straight path with the normal n the coupling is linear, with W(z) = kp_c + ki_c T / (1 - 1/z). The
open loop of both axes is diag(L_x, L_y) + diag(G_x, G_y) W n n', L of `loop_margins` and G = dL / dkp. Ms is
the largest singular value of its sensitivity at any frequency, in any direction. For equal axes it is that of
one axis with kp + kp_c beside the path, and with kp along it. As the coupling is of rank one, both loops stay
stable if 1 + W n' diag(G / (1 + L)) n does not go round 0 (Nyquist).
"""

import math

import numpy as np

from kernels.arrays import Array
from servo_ctrl.control.contour_control import Params
from servo_ctrl.control.loop_margins import Response, all_frequencies_hz, open_loop
from servo_ctrl.control.tick import AxisParams

ANGLES_RAD = np.linspace(0.0, 0.5 * math.pi, 13)
"""Directions of the path; the others are mirrored ones, which have the same singular values."""


def coupled_sensitivity_peak(
    contour: Params, first: AxisParams, second: AxisParams, first_kg: float, second_kg: float
) -> float:
    """Return Ms of two coupled axes with these masses; infinite where the coupling makes them unstable."""
    frequency_hz = all_frequencies_hz(contour.period_s)
    z = np.exp(2j * math.pi * frequency_hz * contour.period_s)
    law = contour.kp_1_s + contour.ki_1_s2 * contour.period_s / (1.0 - 1.0 / z)
    loops = open_loop(first, first_kg, frequency_hz), open_loop(second, second_kg, frequency_hz)
    gains = (
        loop_per_gain(first, first_kg, frequency_hz),
        loop_per_gain(second, second_kg, frequency_hz),
    )
    return max(_peak(loops, gains, law, angle_rad) for angle_rad in ANGLES_RAD.tolist())


def loop_per_gain(params: AxisParams, mass_kg: float, frequency_hz: Array) -> Response:
    """Return how the open loop grows with the gain of the position loop, in which it is linear, seconds."""
    position = params.position_loop
    more = params._replace(position_loop=position._replace(kp_1_s=position.kp_1_s + 1.0))
    return np.asarray(open_loop(more, mass_kg, frequency_hz) - open_loop(params, mass_kg, frequency_hz))


def _peak(
    loops: tuple[Response, Response], gains: tuple[Response, Response], law: Response, angle_rad: float
) -> float:
    normal = -math.sin(angle_rad), math.cos(angle_rad)
    around = 1.0 + law * sum(n**2 * g / (1.0 + loop) for n, g, loop in zip(normal, gains, loops, strict=True))
    turned_rad = np.unwrap(np.angle(around))[-1]  # ends on the real axis, at half the sampling rate
    if abs(turned_rad) > 0.5 * math.pi:
        return math.inf
    # 1 + L, row by row; the singular values of its inverse are 1 over its own
    a = 1.0 + loops[0] + gains[0] * law * normal[0] ** 2
    b = gains[0] * law * normal[0] * normal[1]
    c = gains[1] * law * normal[0] * normal[1]
    d = 1.0 + loops[1] + gains[1] * law * normal[1] ** 2
    squares = np.abs(a) ** 2 + np.abs(b) ** 2 + np.abs(c) ** 2 + np.abs(d) ** 2
    determinant = np.abs(a * d - b * c)
    largest_squared = 0.5 * (squares + np.sqrt(np.maximum(squares**2 - 4.0 * determinant**2, 0.0)))
    return float((np.sqrt(largest_squared) / determinant).max())
