"""Axes and their laws in state space, closed by matrices: what stability is held against.

They share nothing with the transfer functions of the package: plants by the matrix exponential, laws as
difference equations, and loops closed by a feedback of their states.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, expm

from kernels.arrays import Array
from servo_ctrl.control.contour_control import Params as Contour
from servo_ctrl.control.contour_margin import ANGLES_RAD
from servo_ctrl.control.modal_model import ModalModel
from servo_ctrl.control.tick import AxisParams

T = 1e-3
"""The period, seconds."""


class StateSpace(NamedTuple):
    """x+ = a x + b u, y = c x + d u."""

    a: Array
    b: Array
    c: Array
    d: Array


def series(first: StateSpace, then: StateSpace) -> StateSpace:
    """The output of the first one is the input of the other."""
    a = np.block([[first.a, np.zeros((len(first.a), len(then.a)))], [then.b @ first.c, then.a]])
    return StateSpace(
        a, np.vstack([first.b, then.b @ first.d]), np.hstack([then.d @ first.c, then.c]), then.d @ first.d
    )


def filtered(numerator: list[float], denominator: list[float]) -> StateSpace:
    """A filter in powers of 1/z, as the controller canonical form; the denominator begins with 1."""
    order = max(len(numerator), len(denominator)) - 1
    b = np.array([*numerator, *[0.0] * (order + 1 - len(numerator))])
    a = np.array([*denominator, *[0.0] * (order + 1 - len(denominator))])
    states = np.vstack([-a[1:], np.eye(order)[: order - 1]]) if order else np.zeros((0, 0))
    return StateSpace(
        states,
        np.eye(order)[:, :1] if order else np.zeros((0, 1)),
        (b[1:] - b[0] * a[1:]).reshape(1, order),
        np.array([[b[0]]]),
    )


def plant_of(model: ModalModel) -> StateSpace:
    """Force set point to positions of motor and scale: exact for a held force, also with a part of a period
    of delay; one period until the set point acts."""
    blocks, motor, scale = [np.array([[0.0, 1.0], [0.0, -model.friction_1_s]])], [model.motor_1_kg, 0.0], []
    scale = [model.scale_1_kg, 0.0]
    for mode in model.modes:
        w = 2.0 * math.pi * mode.frequency_hz
        blocks.append(np.array([[0.0, 1.0], [-w * w, -2.0 * mode.damping_ratio * w]]))
        motor += [mode.motor_1_kg, 0.0]
        scale += [mode.scale_1_kg, 0.0]
    a = block_diag(*blocks)
    b = np.tile([0.0, 1.0], len(blocks))[:, np.newaxis]
    whole, part = divmod(model.delay_s / T, 1.0)
    size = len(a)

    def held(duration_s: float) -> tuple[Array, Array]:
        both = expm(np.block([[a, b], [np.zeros((1, size + 1))]]) * duration_s)
        return both[:size, :size], both[:size, size:]

    over, _ = held((1.0 - part) * T)
    early, late = held(part * T)[1], held((1.0 - part) * T)[1]
    states = np.block([[held(T)[0], over @ early], [np.zeros((1, size + 1))]])
    inputs = np.vstack([late, [[1.0]]])
    outputs = np.hstack([np.array([motor, scale]), np.zeros((2, 1))])
    plant = StateSpace(states, inputs, outputs, np.zeros((2, 1)))
    return series(filtered([0.0] * (1 + int(whole)) + [1.0], [1.0]), plant)


def parallel(*parts: StateSpace) -> StateSpace:
    """The sum of the outputs, of one input."""
    return StateSpace(
        block_diag(*[part.a for part in parts]),
        np.vstack([part.b for part in parts]),
        np.hstack([part.c for part in parts]),
        np.sum([part.d for part in parts], axis=0),
    )


def pi_law(proportional: float, integral: float) -> StateSpace:
    """A gain and the sum over time; without the sum it has no state, whose pole would be on the circle."""
    if integral == 0.0:
        return filtered([proportional], [1.0])
    return filtered([proportional + integral * T, -proportional], [1.0, -1.0])


def of_input(part: StateSpace, row: Array) -> StateSpace:
    """The part of a weighted sum of inputs."""
    return part._replace(b=part.b @ row, d=part.d @ row)


def force_law(p: AxisParams) -> StateSpace:
    """A velocity set point to the force."""
    n, law = p.notch, pi_law(p.velocity_loop.kv_n_s_m, p.velocity_loop.ki_n_m)
    return series(law, filtered([n.b0, n.b1, n.b2], [1.0, n.b1, n.a2])) if n.enabled else law


def velocity_of(p: AxisParams) -> StateSpace:
    """Positions of motor and scale to minus the velocity error."""
    position, velocity = p.position_loop, p.velocity_loop
    blend, window, fresh = position.derivative_blend, velocity.window_samples, velocity.filter_blend
    rate, gain = position.kd * blend / T, fresh / (window * T)
    motor, scale = np.array([[1.0, 0.0]]), np.array([[0.0, 1.0]])
    return parallel(
        of_input(pi_law(position.kp_1_s, position.ki_1_s2), scale),
        of_input(filtered([rate, -rate], [1.0, blend - 1.0]), scale),
        of_input(filtered([gain, *[0.0] * (window - 1), -gain], [1.0, fresh - 1.0]), motor),
    )


def law_of(p: AxisParams) -> StateSpace:
    """Positions of motor and scale to minus the force."""
    return series(velocity_of(p), force_law(p))


def law_with_observer(p: AxisParams) -> StateSpace:
    """The same with the observer, which is on and has no viscous friction in its model.

    It adds the filtered force of its mass, less the filtered force that acted: a feedback of the force.
    """
    observer = p.observer
    low = filtered([observer.filter_blend], [1.0, observer.filter_blend - 1.0])
    second = filtered((observer.mass_kg / T**2 * np.array([1.0, -2.0, 1.0])).tolist(), [1.0])
    watch = of_input(series(second, low), np.array([[1.0, 0.0]]))
    recall = series(filtered([0.0, 0.0, 0.5, 0.5], [1.0]), low)  # of the force itself, without a direct part
    forward = parallel(law_of(p), watch)
    states = np.block(
        [
            [forward.a, np.zeros((len(forward.a), len(recall.a)))],
            [-recall.b @ forward.c, recall.a + recall.b @ recall.c],
        ]
    )
    inputs, outputs = np.vstack([forward.b, -recall.b @ forward.d]), np.hstack([forward.c, -recall.c])
    return StateSpace(states, inputs, outputs, forward.d)


def radius(*loops: tuple[StateSpace, StateSpace]) -> float:
    """The spectral radius of loops that are closed by minus their output."""
    largest = []
    for plant, law in loops:
        whole = series(plant, law)
        assert not whole.d.any()
        largest.append(np.abs(np.linalg.eigvals(whole.a - whole.b @ whole.c)).max())
    return float(max(largest))


def stacked(parts: list[StateSpace]) -> StateSpace:
    """Both axes side by side."""
    return StateSpace(*(block_diag(*[getattr(part, name) for part in parts]) for name in StateSpace._fields))


def coupled_radius(axes: list[tuple[AxisParams, ModalModel]], contour: Contour) -> float:
    """The largest spectral radius of two axes and the coupling of their errors, over all directions."""
    plants = stacked([plant_of(model) for _, model in axes])
    velocities = stacked([velocity_of(params) for params, _ in axes])
    forces = stacked([force_law(params) for params, _ in axes])
    scales = np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    largest = []
    for angle_rad in ANGLES_RAD.tolist():
        normal = np.array([[-math.sin(angle_rad), math.cos(angle_rad)]])
        error = of_input(pi_law(contour.kp_1_s, contour.ki_1_s2), normal @ scales)
        towards = error._replace(c=normal.T @ error.c, d=normal.T @ error.d)
        largest.append(radius((plants, series(parallel(velocities, towards), forces))))
    return max(largest)
