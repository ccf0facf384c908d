"""Robustness of two axes that contour control couples, for all directions of the path.

Along a straight path with the normal n the coupling is linear, with W(z) = kp_c + ki_c T / (1 - 1/z). The
open loop of both axes is diag(L_x, L_y) + diag(G_x, G_y) W n n', with L open at the set points of the
amplifiers and G = dL / dkp: measured, or of a rigid mass. Ms is the largest singular value of its sensitivity
at any frequency, in any direction (Skogestad and Postlethwaite, Multivariable Feedback Control, sections 3.3
and 9.2). For equal axes it is that of one axis with kp + kp_c beside the path, and with kp along it. As the
coupling is of rank one, two stable loops stay stable if 1 + W n' diag(G / (1 + L)) n does not go round 0
(`control.stability`).
"""

import math

import numpy as np

from kernels.arrays import Array
from kernels.jit import kernel
from servo_ctrl.control.axis_loop import (
    CoupledLoop,
    Plant,
    Response,
    characteristic_of,
    coupled_loop_of,
    integrators_of,
    on_circle,
)
from servo_ctrl.control.contour_control import Params
from servo_ctrl.control.stability import is_stable
from servo_ctrl.control.tick import AxisParams

ANGLES_RAD = np.linspace(0.0, 0.5 * math.pi, 13)
"""Directions of the path; the others are mirrored ones, which have the same singular values."""


LoopPair = tuple[CoupledLoop, CoupledLoop]


def coupled_sensitivity_peak(
    contour: Params, first: AxisParams, second: AxisParams, first_plant: Plant, second_plant: Plant
) -> float:
    """Return Ms of two coupled axes, whose plants share their frequencies; infinite where unstable."""
    axes = (first, first_plant), (second, second_plant)
    if not all(stable_alone(params, plant) for params, plant in axes):
        return math.inf
    pair = coupled_loop_of(first, first_plant), coupled_loop_of(second, second_plant)
    return pair_sensitivity_peak(
        pair, contour_law(contour, first_plant.frequency_hz), contour_integrators(contour)
    )


def stable_alone(params: AxisParams, plant: Plant) -> bool:
    """Whether an axis without coupling is stable, without its observer and with it."""
    plain = params._replace(observer=params.observer._replace(enabled=False))
    return all(is_stable(characteristic_of(one, plant), integrators_of(one)) for one in (plain, params))


def stays_stable(alone: CoupledLoop, observed: CoupledLoop) -> bool:
    """Whether its observer leaves a stable loop stable: the quotient of both does not go round 0.

    Both gains per kp differ by the poles that the observer has while its loop is open.
    """
    quotient = (1.0 + observed.loop) / (1.0 + alone.loop) * (alone.per_gain / observed.per_gain)
    return is_stable(quotient, 0)


def contour_integrators(contour: Params) -> int:
    """Return the number of integrators in W."""
    return int(contour.ki_1_s2 > 0.0)


def contour_law(contour: Params, frequency_hz: Array) -> Response:
    """Return W, velocity per contour error, 1/s, (n,)."""
    z = on_circle(frequency_hz, contour.period_s)
    return np.asarray(contour.kp_1_s + contour.ki_1_s2 * contour.period_s / (1.0 - 1.0 / z))


def pair_sensitivity_peak(pair: LoopPair, law: Response, integrators: int) -> float:
    """Return Ms of two axes, each of them stable alone; infinite where the coupling makes them unstable.

    `law`: W, with so many integrators, on the ascending frequencies of both loops, (n,), up to half the
    sampling rate.
    """
    return largest_peak(*pair, law, integrators, ANGLES_RAD)


@kernel
def largest_peak(
    first: CoupledLoop, second: CoupledLoop, law: Response, integrators: int, angles_rad: Array
) -> float:
    """Return the largest Ms of these directions of the path, likewise."""
    peak = 0.0
    for angle_rad in angles_rad:
        peak = max(peak, direction_peak(first, second, law, integrators, angle_rad))
    return peak


@kernel
def direction_peak(
    first: CoupledLoop, second: CoupledLoop, law: Response, integrators: int, angle_rad: float
) -> float:
    """Return Ms for one direction of the path, likewise."""
    n1, n2, peak = -math.sin(angle_rad), math.cos(angle_rad), 0.0
    around = np.empty_like(law)
    for k in range(len(law)):
        own, other = 1.0 + first.loop[k], 1.0 + second.loop[k]
        added, added_other = first.per_gain[k] * law[k], second.per_gain[k] * law[k]
        a, b = own + n1 * n1 * added, n1 * n2 * added
        c, d = n1 * n2 * added_other, other + n2 * n2 * added_other
        peak = max(peak, largest_of_inverse(a, b, c, d))
        # as the quotient of two determinants, of which only the angle counts: 1 + W n' diag(G / (1 + L)) n
        around[k] = (a * d - b * c) * (own * other).conjugate()
    return peak if is_stable(around, integrators) else math.inf


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
