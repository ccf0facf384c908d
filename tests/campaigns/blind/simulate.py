"""Simulate the concealed axis: position Verlet at some tens of microseconds, Bouc-Wen friction.

Friction is a level times z, dz/dx = (1 - |z|^n (u + (1 - u) sgn(z v))) / length (Bouc 1967, Wen 1976): no
bristle's exponential. A play's contact is Hunt and Crossley's (1975), K d^1.5 (1 + c d'). Each cause writes
down the force that it costs the motor, so that what is concealed is known to the newton.
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
    "rubbing_n",
)
CAUSES = (
    *("presliding", "uneven", "uneven_viscous", "rise", "drag", "age", "worn", "thin", "weight", "chain"),
    *("hum", "foreign", "towed", "detent", "small", "uneven_torque", "full", "lost", "slow", "late"),
    *("voltage", "shake"),
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
    shake: Array,
    motor_noise: Array,
    scale_noise: Array,
    towing: Array,
    start_m: float,
) -> Array:
    """Return rows (n, WIDTH), one a control period. `reference` (n, 3): position, velocity, acceleration."""
    n = len(reference)
    out = np.zeros((n, WIDTH))
    steps = max(round(period_s / step_s), 1)
    h = period_s / steps
    x1 = x2 = reference[0, 0]
    v1 = v2 = 0.0
    z1 = z2 = 0.0
    age, pulled, xa, va = 1.0, 0.0, x2, 0.0
    i1, i2 = 0.0, 0.0  # the slow current and its rate
    integral, slope, y_old = 0.0, 0.0, x1
    commands = np.zeros(n)
    origin = 0.0
    rigid = p.flexible == 0.0
    for k in range(n):
        t = k * period_s
        # sensors
        bend = p.wobble_m * math.sin(p.wobble_1_m * (x1 + start_m) + p.wobble_rad)
        bend += p.wobble_2_m * math.sin(2.0 * (p.wobble_1_m * (x1 + start_m) + p.wobble_rad) + 0.7)
        table = x1 + bend if rigid else x2
        y1 = x1 + p.eccentric_m * math.sin(p.eccentric_1_m * (x1 + start_m) + p.eccentric_rad)
        y2 = table * (1.0 + p.stretch) + p.cyclic_m * wave(
            p.cyclic_1_m * (table + start_m) + p.cyclic_rad, p.cyclic_skew
        )
        if k == 0:
            origin = y2 - y1
        y1 = quantised(y1 + motor_noise[k], p.motor_count_m)
        y2 = quantised(y2 - origin + scale_noise[k], p.scale_count_m)
        # controller
        if k == 0:
            y_old = y1
        keep = math.exp(-2.0 * math.pi * c.filter_hz * period_s)
        slope = keep * slope + (1.0 - keep) * (y1 - y_old) / period_s
        y_old = y1
        e = reference[k, 0] - (y2 if c.on_scale > 0.0 else y1)
        ahead = c.feed_acceleration * reference[k, 2] + c.feed_velocity * reference[k, 1]
        if c.cascade > 0.0:
            e = reference[k, 1] + c.kp * e - slope
            u = c.kd * e + integral + ahead
        else:
            u = c.kp * e + integral + c.kd * (reference[k, 1] - slope) + ahead
        if abs(u) < c.limit_n:
            integral += c.ki * e * period_s
        u = min(max(u, -c.limit_n), c.limit_n)
        commands[k] = u
        late = p.later_s if t >= p.later_at_s else p.late_s
        for s in range(steps):
            now = t + s * h
            # command to current
            back = int((now - late) / period_s) if now >= late else 0
            arrived = commands[min(back, k)]
            kept = arrived
            if p.lost_n > 0.0:
                w2 = p.lost_smooth_n**2
                kept += 0.5 * (
                    math.sqrt((arrived - p.lost_n) ** 2 + w2) - math.sqrt((arrived + p.lost_n) ** 2 + w2)
                )
            current = kept
            if p.slow_rad_s > 0.0:
                i2 += h * (p.slow_rad_s**2 * (kept - i1) - 2.0 * p.slow_damping * p.slow_rad_s * i2)
                i1 += h * i2
                current = i1
            limited = current
            if p.stall_n > 0.0:
                most = max(p.stall_n * (1.0 - v1 / p.no_load_m_s), 0.0)
                least = min(-p.stall_n * (1.0 + v1 / p.no_load_m_s), 0.0)
                limited = min(max(current, least), most)
            developed = limited
            if p.full_n > 0.0:
                developed = p.full_n * math.atan(limited / p.full_n)
            full = limited - developed
            torque = 1.0 + p.uneven_torque * wave(p.torque_1_m * (x1 + start_m) + p.torque_rad, p.torque_skew)
            force = developed * torque
            # half a step of position
            x1 += 0.5 * h * v1
            x2 = x1 if rigid else x2 + 0.5 * h * v2
            if rigid:
                v2 = v1
            # friction
            age += h * (1.0 - abs(v2) * age / p.age_m)
            age = max(age, 0.0)
            factor = 1.0 - p.thin * rise_share[k]
            rise = p.rise_n / (1.0 + (abs(v2) / p.rise_m_s) ** p.rise_power) if p.rise_n != 0.0 else 0.0
            old = p.age_n * math.log1p(age / p.age_s) if p.age_n > 0.0 else 0.0
            worn = p.worn_n * math.tanh((x2 - p.worn_at_m) / p.worn_m) if p.worn_n != 0.0 else 0.0
            starved = p.starved_n if now >= p.starved_at_s else 0.0
            z2 = bouc_wen(z2, h * v2 / p.presliding_m, p.sharpness, p.unloading)
            level = max((p.coulomb_n + rise + worn + starved) * factor + old, 0.0)
            z1 = z2 if rigid else bouc_wen(z1, h * v1 / p.presliding_m, p.sharpness, p.unloading)
            rub1 = p.nut_share * ((level + p.uneven_n * z1) * z1 + factor * p.viscous_n_s_m * v1)
            rub2 = (1.0 - p.nut_share) * ((level + p.uneven_n * z2) * z2 + factor * p.viscous_n_s_m * v2)
            drag = p.drag * abs(v2) ** p.drag_power * (1.0 if v2 > 0.0 else -1.0) if p.drag > 0.0 else 0.0
            uneven = p.uneven_n_s_m * abs(v2)
            rub2 += drag + uneven
            # forces
            detent = p.detent_n * wave(p.detent_1_m * (x1 + start_m) + p.detent_rad, p.detent_skew)
            small = p.small_n * math.sin(p.small_1_m * (x1 + start_m) + p.small_rad)
            hum = p.hum_n * wave(p.hum_rad_s * now + p.hum_rad, p.hum_skew) if p.hum_n > 0.0 else 0.0
            chain = p.chain_n * math.tanh((x2 - p.chain_at_m) / p.chain_m) if p.chain_n != 0.0 else 0.0
            lean = p.lean_n if now >= p.lean_at_s else 0.0
            foreign = lean
            if p.bump_n != 0.0:
                foreign += p.bump_n / math.cosh(min(abs(x2 - p.bump_at_m) / p.bump_m, 50.0)) ** 2
            if p.relaxing_n_s_m > 0.0:
                pulled += h * (p.relaxing_n_s_m * v2 - pulled) / p.relaxing_s
                foreign += pulled
            tow = p.towed_kg * towing[k]
            load = p.weight_n + chain + hum + foreign + tow + shake[k]
            aside = 0.0
            if p.aside_kg > 0.0:
                aside = p.aside_kg * (
                    p.aside_rad_s**2 * (x2 - xa) + 2.0 * p.aside_damping * p.aside_rad_s * (v2 - va)
                )
                va += h * aside / p.aside_kg
                xa += h * va
                load += aside
            more = p.loaded_kg if now >= p.loaded_at_s else 0.0
            # the step of velocity, and the other half of position
            before = v1
            if rigid:
                angle = p.wobble_1_m * (x1 + start_m) + p.wobble_rad
                lever = 1.0 + p.wobble_1_m * p.wobble_m * math.cos(angle)
                lever += 2.0 * p.wobble_1_m * p.wobble_2_m * math.cos(2.0 * angle + 0.7)
                curve = -(p.wobble_1_m**2) * p.wobble_m * math.sin(angle)
                curve -= 4.0 * p.wobble_1_m**2 * p.wobble_2_m * math.sin(2.0 * angle + 0.7)
                moved = p.table_kg + more
                net = force - detent - small - rub1 - lever * (rub2 + load + moved * curve * v1 * v1)
                v1 += h * net / (p.motor_kg + lever * lever * moved)
            else:
                bend = p.wobble_m * math.sin(p.wobble_1_m * (x1 + start_m) + p.wobble_rad)
                reach = x1 + bend - x2
                beyond = abs(reach) - 0.5 * p.gap_m
                pushed = 0.0
                if beyond > 0.0:
                    side = 1.0 if reach > 0.0 else -1.0
                    closing = side * (v1 - v2)
                    pushed = p.contact * beyond**p.contact_power * (1.0 + p.contact_loss_s_m * closing)
                    pushed += p.spring_n_s_m * closing
                    pushed = side * max(pushed, 0.0)
                v1 += h * (force - detent - small - rub1 - pushed) / p.motor_kg
                v2 += h * (pushed - rub2 - load) / (p.table_kg + more)
                x2 += 0.5 * h * v2
            x1 += 0.5 * h * v1
            if rigid:
                x2 = x1
            if s == 0:
                row = out[k]
                row[0], row[1], row[2], row[3] = x1, x2 if not rigid else table, y1, y2
                row[4], row[5], row[6] = u, limited, before
                sign = 1.0 if v2 > 0.0 else (-1.0 if v2 < 0.0 else 0.0)
                z = p.nut_share * z1 + (1.0 - p.nut_share) * z2
                row[7] = p.coulomb_n * z
                row[C0] = p.coulomb_n * (z - sign)
                row[C0 + 1] = p.uneven_n * z * z
                row[C0 + 2] = uneven
                row[C0 + 3] = rise * z
                row[C0 + 4] = drag
                row[C0 + 5] = old * z
                row[C0 + 6] = worn * z
                row[C0 + 7] = (factor - 1.0) * (p.coulomb_n * z + p.viscous_n_s_m * v2)
                row[C0 + 8] = p.weight_n
                row[C0 + 9] = chain
                row[C0 + 10] = hum
                row[C0 + 11] = foreign + starved * z + aside + more * (v1 - before) / h
                row[C0 + 12] = tow
                row[C0 + 13] = detent
                row[C0 + 14] = small
                row[C0 + 15] = developed * (1.0 - torque)
                row[C0 + 16] = full
                row[C0 + 17] = arrived - kept
                row[C0 + 18] = kept - current
                row[C0 + 19] = u - arrived
                row[C0 + 20] = current - limited
                row[C0 + 21] = shake[k]
        if not (abs(x1) < 1e3):
            out[:, 0] = np.nan
            return out
    return out
