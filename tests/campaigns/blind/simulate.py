"""Simulate the concealed axis; record the force that each cause takes from the motor, as the exact truth."""

import numpy as np

from tests.campaigns.blind.arrays import Array
from tests.campaigns.blind.axis.controller import ControllerState, command_n
from tests.campaigns.blind.axis.drive import delayed_n
from tests.campaigns.blind.axis.record import FIRST_CAUSE, WIDTH, Signals, causes
from tests.campaigns.blind.axis.sensors import encoder_m, scale_m, table_position_m
from tests.campaigns.blind.axis.step import Surroundings, at_rest, step
from tests.campaigns.blind.compiled import compiled
from tests.campaigns.blind.nonlinearities import quantised
from tests.campaigns.blind.plant import Loop, Plant

UNSTABLE_M = 1e3
"""A motor that is farther away belongs to an unstable loop; chosen."""


@compiled
def run(
    p: Plant,
    c: Loop,
    reference: Array,
    period_s: float,
    step_s: float,
    rise_share: Array,
    noise_n: Array,
    motor_noise_m: Array,
    scale_noise_m: Array,
    coupled_m_s2: Array,
    start_m: float,
) -> Array:
    """Return rows (n, WIDTH), one a control period; NaN where the loop is unstable.

    `reference` (n, 3): position, velocity, acceleration, SI; `rise_share`: share of the temperature rise;
    `noise_n`: force on the table; `coupled_m_s2`: acceleration of the other axis; each (n,).
    """
    n = len(reference)
    out = np.zeros((n, WIDTH))
    steps = max(round(period_s / step_s), 1)
    h = period_s / steps
    state = at_rest(reference[0, 0])
    controller = ControllerState(0.0, 0.0, 0.0)
    commands = np.zeros(n)
    origin = 0.0
    for k in range(n):
        t = k * period_s
        motor = state.bodies.motor_m
        table = table_position_m(p, state.bodies, start_m)
        encoder, scale = encoder_m(p, motor, start_m), scale_m(p, table, start_m)
        if k == 0:
            origin = scale - encoder
        encoder = quantised(encoder + motor_noise_m[k], p.motor_count_m)
        scale = quantised(scale - origin + scale_noise_m[k], p.scale_count_m)
        if k == 0:
            controller = ControllerState(0.0, 0.0, encoder)
        commands[k], controller = command_n(c, controller, reference[k], encoder, scale, period_s)
        around = Surroundings(rise_share[k], noise_n[k], coupled_m_s2[k])
        for s in range(steps):
            now = t + s * h
            delayed = delayed_n(p, commands, k, t, now, period_s)
            before_m_s = state.bodies.motor_m_s
            state, forces = step(p, state, delayed, around, start_m, now, h)
            if s == 0:
                b, hysteresis = state.bodies, state.friction
                z = p.nut_share * hysteresis.motor_z + (1.0 - p.nut_share) * hysteresis.table_z
                signals = Signals(
                    motor_m=b.motor_m,
                    table_m=table if p.has_compliance == 0.0 else b.table_m,
                    encoder_m=encoder,
                    scale_m=scale,
                    command_n=commands[k],
                    current_n=forces.drive.limited_n,
                    velocity_m_s=before_m_s,
                    coulomb_friction_n=p.coulomb_n * z,
                )
                of_causes = causes(p, commands[k], forces, state, z, noise_n[k])
                for column in range(FIRST_CAUSE):
                    out[k, column] = signals[column]
                for column in range(FIRST_CAUSE, WIDTH):
                    out[k, column] = of_causes[column - FIRST_CAUSE]
        if not (abs(state.bodies.motor_m) < UNSTABLE_M):
            out[:, 0] = np.nan
            return out
    return out
