"""Simulate the concealed axis: position Verlet at some tens of microseconds, Bouc-Wen friction.

Friction is a level times z, dz/dx = (1 - |z|^n (u + (1 - u) sgn(z v))) / length (Bouc 1967, Wen 1976), not
the exponential of a bristle model. The contact behind a backlash is that of Hunt and Crossley (1975),
K d^1.5 (1 + c d'). The force that each cause takes from the motor is recorded, so that the truth is exact.
"""

import math

import numpy as np
from numba import njit

from tests.campaigns.blind.arrays import Array
from tests.campaigns.blind.nonlinearities import bouc_wen, quantised, wave
from tests.campaigns.blind.plant import Loop, Plant

SIGNALS = (
    "motor_m",
    "table_m",
    "encoder_m",
    "scale_m",
    "command_n",
    "current_n",
    "velocity_m_s",
    "coulomb_friction_n",
)
CAUSES = (
    *("presliding", "coulomb_asymmetry", "viscous_asymmetry", "stribeck", "quadratic", "dwell"),
    *("position_friction", "temperature", "constant", "position_force", "disturbance", "foreign"),
    *("coupling", "cogging", "clutter", "torque_ripple", "saturation", "dead_zone", "current_loop"),
    *("delay", "voltage", "noise"),
)
"""Additional forces that the motor must supply, N, in the order of their columns."""
AT = {name: index for index, name in enumerate((*SIGNALS, *CAUSES))}
WIDTH = len(AT)
C0 = len(SIGNALS)


@njit(cache=True)
def run(  # noqa: C901, PLR0912, PLR0915  # one loop over time, every cause in its place
    p: Plant,
    c: Loop,
    reference: Array,
    period_s: float,
    step_s: float,
    rise_share: Array,
    noise_n: Array,
    motor_noise: Array,
    scale_noise: Array,
    coupled_m_s2: Array,
    start_m: float,
) -> Array:
    """Return rows (n, WIDTH), one a control period; NaN where the loop is unstable.

    `reference` (n, 3): position, velocity, acceleration, SI; `rise_share`: share of the temperature rise;
    `noise_n`: force on the table; `motor_noise`, `scale_noise`: metres; `coupled_m_s2`: acceleration of the
    other axis; each (n,).
    """
    n = len(reference)
    out = np.zeros((n, WIDTH))
    steps = max(round(period_s / step_s), 1)
    h = period_s / steps
    x1 = x2 = reference[0, 0]
    v1 = v2 = 0.0
    z1 = z2 = 0.0
    age, relaxation, absorber_m, absorber_m_s = 1.0, 0.0, x2, 0.0
    current1, current_rate = 0.0, 0.0  # current of the second-order loop, and its rate
    integral, rate, y_old = 0.0, 0.0, x1
    commands = np.zeros(n)
    origin = 0.0
    rigid = p.has_compliance == 0.0
    for k in range(n):
        t = k * period_s
        # sensors
        bend = p.lead_error_m * math.sin(p.lead_error_1_m * (x1 + start_m) + p.lead_error_phase_rad)
        bend += p.lead_error_second_m * math.sin(
            2.0 * (p.lead_error_1_m * (x1 + start_m) + p.lead_error_phase_rad) + 0.7
        )
        table = x1 + bend if rigid else x2
        y1 = x1 + p.eccentricity_m * math.sin(p.eccentricity_1_m * (x1 + start_m) + p.eccentricity_phase_rad)
        y2 = table * (1.0 + p.relative_lead_error) + p.interpolation_error_m * wave(
            p.interpolation_error_1_m * (table + start_m) + p.interpolation_error_phase_rad,
            p.interpolation_error_skew,
        )
        if k == 0:
            origin = y2 - y1
        y1 = quantised(y1 + motor_noise[k], p.motor_count_m)
        y2 = quantised(y2 - origin + scale_noise[k], p.scale_count_m)
        # controller
        if k == 0:
            y_old = y1
        keep = math.exp(-2.0 * math.pi * c.filter_hz * period_s)
        rate = keep * rate + (1.0 - keep) * (y1 - y_old) / period_s
        y_old = y1
        error = reference[k, 0] - (y2 if c.on_scale > 0.0 else y1)
        feedforward = c.mass_feedforward_kg * reference[k, 2] + c.viscous_feedforward_n_s_m * reference[k, 1]
        if c.cascade > 0.0:
            error = reference[k, 1] + c.kp * error - rate
            command = c.kd * error + integral + feedforward
        else:
            command = c.kp * error + integral + c.kd * (reference[k, 1] - rate) + feedforward
        if abs(command) < c.force_limit_n:
            integral += c.ki * error * period_s
        command = min(max(command, -c.force_limit_n), c.force_limit_n)
        commands[k] = command
        delay = p.delay_after_step_s if t >= p.delay_step_at_s else p.delay_s
        for s in range(steps):
            now = t + s * h
            # command to current
            sample = int((now - delay) / period_s) if now >= delay else 0
            delayed = commands[min(sample, k)]
            after_dead_zone = delayed
            if p.dead_zone_n > 0.0:
                w2 = p.dead_zone_rounding_n**2
                after_dead_zone += 0.5 * (
                    math.sqrt((delayed - p.dead_zone_n) ** 2 + w2)
                    - math.sqrt((delayed + p.dead_zone_n) ** 2 + w2)
                )
            current = after_dead_zone
            if p.current_loop_rad_s > 0.0:
                current_rate += h * (
                    p.current_loop_rad_s**2 * (after_dead_zone - current1)
                    - 2.0 * p.current_loop_damping * p.current_loop_rad_s * current_rate
                )
                current1 += h * current_rate
                current = current1
            limited = current
            if p.stall_n > 0.0:
                upper = max(p.stall_n * (1.0 - v1 / p.no_load_m_s), 0.0)
                lower = min(-p.stall_n * (1.0 + v1 / p.no_load_m_s), 0.0)
                limited = min(max(current, lower), upper)
            developed = limited
            if p.saturation_n > 0.0:
                developed = p.saturation_n * math.atan(limited / p.saturation_n)
            saturation_loss = limited - developed
            torque = 1.0 + p.torque_ripple * wave(
                p.torque_ripple_1_m * (x1 + start_m) + p.torque_ripple_phase_rad, p.torque_ripple_skew
            )
            force = developed * torque
            # half a step of position
            x1 += 0.5 * h * v1
            x2 = x1 if rigid else x2 + 0.5 * h * v2
            if rigid:
                v2 = v1
            # friction
            age += h * (1.0 - abs(v2) * age / p.dwell_reset_m)
            age = max(age, 0.0)
            factor = 1.0 - p.temperature_share * rise_share[k]
            stribeck = (
                p.stribeck_n / (1.0 + (abs(v2) / p.stribeck_m_s) ** p.stribeck_exponent)
                if p.stribeck_n != 0.0
                else 0.0
            )
            dwell = p.dwell_n * math.log1p(age / p.dwell_s) if p.dwell_n > 0.0 else 0.0
            position_friction = (
                p.position_friction_n
                * math.tanh((x2 - p.position_friction_at_m) / p.position_friction_width_m)
                if p.position_friction_n != 0.0
                else 0.0
            )
            friction_step = p.friction_step_n if now >= p.friction_step_at_s else 0.0
            z2 = bouc_wen(z2, h * v2 / p.presliding_m, p.sharpness, p.unloading)
            level = max((p.coulomb_n + stribeck + position_friction + friction_step) * factor + dwell, 0.0)
            z1 = z2 if rigid else bouc_wen(z1, h * v1 / p.presliding_m, p.sharpness, p.unloading)
            friction1 = p.nut_share * (
                (level + p.coulomb_asymmetry_n * z1) * z1 + factor * p.viscous_n_s_m * v1
            )
            friction2 = (1.0 - p.nut_share) * (
                (level + p.coulomb_asymmetry_n * z2) * z2 + factor * p.viscous_n_s_m * v2
            )
            quadratic = (
                p.quadratic * abs(v2) ** p.quadratic_exponent * (1.0 if v2 > 0.0 else -1.0)
                if p.quadratic > 0.0
                else 0.0
            )
            viscous_asymmetry = p.viscous_asymmetry_n_s_m * abs(v2)
            friction2 += quadratic + viscous_asymmetry
            # forces
            cogging = p.cogging_n * wave(p.cogging_1_m * (x1 + start_m) + p.cogging_phase_rad, p.cogging_skew)
            clutter = p.clutter_n * math.sin(p.clutter_1_m * (x1 + start_m) + p.clutter_phase_rad)
            disturbance = (
                p.disturbance_n
                * wave(p.disturbance_rad_s * now + p.disturbance_phase_rad, p.disturbance_skew)
                if p.disturbance_n > 0.0
                else 0.0
            )
            position_force = (
                p.position_force_n * math.tanh((x2 - p.position_force_at_m) / p.position_force_width_m)
                if p.position_force_n != 0.0
                else 0.0
            )
            force_step = p.force_step_n if now >= p.force_step_at_s else 0.0
            foreign = force_step
            if p.local_force_n != 0.0:
                foreign += (
                    p.local_force_n
                    / math.cosh(min(abs(x2 - p.local_force_at_m) / p.local_force_width_m, 50.0)) ** 2
                )
            if p.relaxation_n_s_m > 0.0:
                relaxation += h * (p.relaxation_n_s_m * v2 - relaxation) / p.relaxation_s
                foreign += relaxation
            coupling = p.coupled_kg * coupled_m_s2[k]
            load = p.constant_n + position_force + disturbance + foreign + coupling + noise_n[k]
            absorber = 0.0
            if p.absorber_kg > 0.0:
                absorber = p.absorber_kg * (
                    p.absorber_rad_s**2 * (x2 - absorber_m)
                    + 2.0 * p.absorber_damping * p.absorber_rad_s * (v2 - absorber_m_s)
                )
                absorber_m_s += h * absorber / p.absorber_kg
                absorber_m += h * absorber_m_s
                load += absorber
            added_kg = p.mass_step_kg if now >= p.mass_step_at_s else 0.0
            # the step of velocity, and the other half of position
            before = v1
            if rigid:
                angle = p.lead_error_1_m * (x1 + start_m) + p.lead_error_phase_rad
                ratio = 1.0 + p.lead_error_1_m * p.lead_error_m * math.cos(angle)
                ratio += 2.0 * p.lead_error_1_m * p.lead_error_second_m * math.cos(2.0 * angle + 0.7)
                ratio_slope = -(p.lead_error_1_m**2) * p.lead_error_m * math.sin(angle)
                ratio_slope -= 4.0 * p.lead_error_1_m**2 * p.lead_error_second_m * math.sin(2.0 * angle + 0.7)
                table_kg = p.table_kg + added_kg
                net = (
                    force
                    - cogging
                    - clutter
                    - friction1
                    - ratio * (friction2 + load + table_kg * ratio_slope * v1 * v1)
                )
                v1 += h * net / (p.motor_kg + ratio * ratio * table_kg)
            else:
                bend = p.lead_error_m * math.sin(p.lead_error_1_m * (x1 + start_m) + p.lead_error_phase_rad)
                twist_m = x1 + bend - x2
                compression_m = abs(twist_m) - 0.5 * p.backlash_gap_m
                contact_n = 0.0
                if compression_m > 0.0:
                    side = 1.0 if twist_m > 0.0 else -1.0
                    closing = side * (v1 - v2)
                    contact_n = (
                        p.contact_stiffness
                        * compression_m**p.contact_power
                        * (1.0 + p.contact_loss_s_m * closing)
                    )
                    contact_n += p.spring_n_s_m * closing
                    contact_n = side * max(contact_n, 0.0)
                v1 += h * (force - cogging - clutter - friction1 - contact_n) / p.motor_kg
                v2 += h * (contact_n - friction2 - load) / (p.table_kg + added_kg)
                x2 += 0.5 * h * v2
            x1 += 0.5 * h * v1
            if rigid:
                x2 = x1
            if s == 0:
                row = out[k]
                row[0], row[1], row[2], row[3] = x1, x2 if not rigid else table, y1, y2
                row[4], row[5], row[6] = command, limited, before
                sign = 1.0 if v2 > 0.0 else (-1.0 if v2 < 0.0 else 0.0)
                z = p.nut_share * z1 + (1.0 - p.nut_share) * z2
                row[7] = p.coulomb_n * z
                row[C0] = p.coulomb_n * (z - sign)
                row[C0 + 1] = p.coulomb_asymmetry_n * z * z
                row[C0 + 2] = viscous_asymmetry
                row[C0 + 3] = stribeck * z
                row[C0 + 4] = quadratic
                row[C0 + 5] = dwell * z
                row[C0 + 6] = position_friction * z
                row[C0 + 7] = (factor - 1.0) * (p.coulomb_n * z + p.viscous_n_s_m * v2)
                row[C0 + 8] = p.constant_n
                row[C0 + 9] = position_force
                row[C0 + 10] = disturbance
                row[C0 + 11] = foreign + friction_step * z + absorber + added_kg * (v1 - before) / h
                row[C0 + 12] = coupling
                row[C0 + 13] = cogging
                row[C0 + 14] = clutter
                row[C0 + 15] = developed * (1.0 - torque)
                row[C0 + 16] = saturation_loss
                row[C0 + 17] = delayed - after_dead_zone
                row[C0 + 18] = after_dead_zone - current
                row[C0 + 19] = command - delayed
                row[C0 + 20] = current - limited
                row[C0 + 21] = noise_n[k]
        if not (abs(x1) < 1e3):
            out[:, 0] = np.nan
            return out
    return out
