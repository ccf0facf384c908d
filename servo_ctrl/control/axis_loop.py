"""The open loop of an axis, from the response of its plant and the exact transfer functions of the law in z.

    u = -N K (R y + W q),   L = N K (R P_y + W P_q)

K is the proportional-integral velocity law, N the notch, R the position law on the feedback y, W the velocity
estimate from the motor position q. In mode csv the amplifier closes the velocity loop: u is a velocity, and
K and W are absent. L is the loop broken at the set point of the amplifier, where all paths meet, so that one
margin holds for all of them.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from servo_ctrl.control.compensation import notch
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.control.types import Output

Response = NDArray[np.complex128]


class Plant(NamedTuple):
    """Responses per set point of the amplifier, on a grid that resolves the modes, (n,) each."""

    frequency_hz: Array
    motor: Response
    feedback: Response
    """Response of the position that the position loop uses: motor or scale."""


class CoupledLoop(NamedTuple):
    """What a coupling of axes meets in one of them, (n,) each."""

    loop: Response
    """L."""
    per_gain: Response
    """G: how L grows with the gain of the position loop, s."""


def on_circle(frequency_hz: Array, period_s: float) -> Response:
    """Z on the unit circle at these frequencies, (n,)."""
    return np.asarray(np.exp(2j * math.pi * frequency_hz * period_s))


def position_law(params: AxisParams, z: Response) -> Response:
    """R: velocity set point per position error, 1/s, (n,)."""
    p, period_s = params.position_loop, params.period_s
    change = p.derivative_blend * (1.0 - 1.0 / z) / period_s / (1.0 - (1.0 - p.derivative_blend) / z)
    return np.asarray(p.kp_1_s + p.ki_1_s2 * period_s / (1.0 - 1.0 / z) + p.kd * change)


def velocity_law(params: AxisParams, z: Response) -> Response:
    """K: force per velocity error, N s/m, (n,)."""
    p = params.velocity_loop
    return np.asarray(p.kv_n_s_m + p.ki_n_m * params.period_s / (1.0 - 1.0 / z))


def velocity_estimate(params: AxisParams, z: Response) -> Response:
    """W: estimated velocity per motor position, 1/s, (n,)."""
    p = params.velocity_loop
    difference = (1.0 - z ** (-p.window_samples)) / (p.window_samples * params.period_s)
    return np.asarray(difference * p.filter_blend / (1.0 - (1.0 - p.filter_blend) / z))


def notch_response(p: notch.Params, z: Response) -> Response:
    """N: the notch, (n,)."""
    if not p.enabled:
        return np.ones(len(z), dtype=np.complex128)
    return np.asarray((p.b0 + p.b1 / z + p.b2 / z**2) / (1.0 + p.b1 / z + p.a2 / z**2))


def observer_paths(params: AxisParams, z: Response) -> tuple[Response, Response]:
    """Return the observer's force per motor position, N/m, and per earlier force; 0 where it is off."""
    period = params.period_s
    blend = params.observer.filter_blend if params.observer.enabled else 0.0
    low_pass = blend / (1.0 - (1.0 - blend) / z)
    mean = 0.5 * (1.0 + 1.0 / z)
    velocity = (1.0 - 1.0 / z) / period
    model = params.observer.mass_kg * velocity**2 + params.observer.viscous_n_s_m * mean * velocity
    # a command acts after one period, and its current is measured at the end of the period
    return low_pass * model, low_pass * mean / z**2


def rigid_mass(period_s: float, mass_kg: float, frequency_hz: Array) -> Response:
    """Return the transfer function from a force held over a period to the position, m/N, (n,)."""
    z = on_circle(frequency_hz, period_s)
    return np.asarray(period_s**2 * (z + 1.0) / (2.0 * mass_kg * (z - 1.0) ** 2))


def rigid_plant(period_s: float, mass_kg: float, frequency_hz: Array) -> Plant:
    """Return a rigid mass whose set point acts one period after its tick."""
    response = rigid_mass(period_s, mass_kg, frequency_hz) / on_circle(frequency_hz, period_s)
    return Plant(frequency_hz, response, response)


def loop_of(params: AxisParams, plant: Plant) -> Response:
    """L on the grid of the plant, (n,)."""
    z = on_circle(plant.frequency_hz, params.period_s)
    paths = position_law(params, z) * plant.feedback
    if params.output == int(Output.FORCE):
        paths = velocity_law(params, z) * (paths + velocity_estimate(params, z) * plant.motor)
    return np.asarray(notch_response(params.notch, z) * paths)


def coupled_loop_of(params: AxisParams, plant: Plant) -> CoupledLoop:
    """What contour control meets in a cst axis: L, with the observer where it is on, and G = N K P_y."""
    z = on_circle(plant.frequency_hz, params.period_s)
    filtered = notch_response(params.notch, z)
    per_gain = filtered * velocity_law(params, z) * plant.feedback
    model, recall = observer_paths(params, z)
    own = 1.0 - filtered * recall
    loop = loop_of(params, plant) + filtered * model * plant.motor
    return CoupledLoop(np.asarray(loop / own), np.asarray(per_gain / own))


def characteristic_of(params: AxisParams, plant: Plant) -> Response:
    """1 + L of a cst axis without the poles that its observer adds to L where it is on, (n,).

    Its zeros are the poles of the closed loop; its own poles are inside the unit circle, or integrators of L.
    """
    z = on_circle(plant.frequency_hz, params.period_s)
    model, recall = observer_paths(params, z)
    observed = notch_response(params.notch, z) * (model * plant.motor - recall)
    return np.asarray(1.0 + loop_of(params, plant) + observed)


def velocity_loop_of(params: AxisParams, plant: Plant) -> Response:
    """The velocity loop alone, with the position loop open, (n,)."""
    z = on_circle(plant.frequency_hz, params.period_s)
    inner = velocity_law(params, z) * velocity_estimate(params, z) * plant.motor
    return np.asarray(notch_response(params.notch, z) * inner)


def integrators_of(params: AxisParams) -> int:
    """Return the number of integrators in L: the loops', and two of a mass, or one of a velocity."""
    own = int(params.position_loop.ki_1_s2 > 0.0)
    if params.output != int(Output.FORCE):
        return own + 1
    return own + int(params.velocity_loop.ki_n_m > 0.0) + 2
