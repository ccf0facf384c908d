"""Equations of the table, solved by backward Euler: every step a Newton iteration for both velocities.

Friction of the guide is four Maxwell elements in parallel whose yield forces fall with speed by Stribeck's
law; within a step each is a spring, held at its yield force when it would exceed that (return mapping).
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from tests.campaigns.blind.families.interface import Array

ELEMENTS = 4
STEPS_A_SAMPLE = 20
NEWTON_STEPS = 12
NEWTON_ENOUGH = 1e-9
"""Change of velocity in m/s at which a Newton iteration ends."""


class Screw(NamedTuple):
    """A true axis in SI; what is 0 is absent."""

    rotor_kg: float = 15.0
    table_kg: float = 25.0
    stiffness: float = 4e8
    damping: float = 2e4
    gap_m: float = 0.0
    viscous: float = 60.0
    coulomb_n: float = 12.0
    preslide_m: float = 1.5e-6
    rise_n: float = 0.0
    rise_m_s: float = 0.004
    bias_n: float = 0.0
    viscous_bias: float = 0.0
    tilt: float = 0.0
    tilt_m: float = 0.1
    push_n: float = 0.0
    thinning: float = 0.0
    lead_m: float = 0.01
    stretch: float = 0.0
    wobble_m: float = 0.0
    off_centre_m: float = 0.0
    growth_1_k: float = 0.0
    grating_m: float = 0.0
    grating_pitch_m: float = 2e-5
    phase: float = 0.0
    encoder_m: float = 1e-8
    scale_m: float = 1e-8


class Gains(NamedTuple):
    """Cascade: position P, velocity PI, with feedforward and a disturbance observer."""

    position_1_s: float
    velocity_n_s_m: float
    integral_1_s: float
    mass_kg: float
    observer_rad_s: float


@njit(cache=True)
def level_n(p: Screw, v: float, x: float, warm: float) -> float:
    """Yield force of the guide in N; `warm` is the share of the temperature rise."""
    wear = 1.0 + p.tilt * math.tanh(x / p.tilt_m)
    return (p.coulomb_n * wear + p.rise_n * math.exp(-abs(v) / p.rise_m_s)) * (1.0 - p.thinning * warm)


@njit(cache=True)
def yielded(p: Screw, slip: Array, level: float, way: float, keep: bool) -> tuple[float, float]:
    """Return friction in N after `way` in m and its slope; `slip` (4,) in N is advanced if `keep`."""
    total, slope = 0.0, 0.0
    for i in range(4):
        limit = 0.25 * level
        stiff = limit / (p.preslide_m * (0.25 + 0.5 * i))
        trial = slip[i] + stiff * way
        if abs(trial) >= limit:
            trial = math.copysign(limit, trial)
        else:
            slope += stiff
        total += trial
        if keep:
            slip[i] = trial
    return total, slope


@njit(cache=True)
def advance(p: Screw, s: Array, slip: Array, drive_n: float, load_n: float, warm: float, h: float) -> None:
    """Advance the state `s` (x1, v1, x2, v2) by `h` seconds under forces at rotor and table."""
    a, b = s[1], s[3]
    level = level_n(p, s[3], s[2], warm)
    for _ in range(NEWTON_STEPS):
        way = s[0] + h * a - s[2] - h * b
        beyond = way - math.copysign(min(abs(way), 0.5 * p.gap_m), way)
        touching = 1.0 if beyond != 0.0 or p.gap_m == 0.0 else 0.0
        link = p.stiffness * beyond + touching * p.damping * (a - b)
        stiff = touching * (p.stiffness * h + p.damping)
        rub, slope = yielded(p, slip, level, h * b, False)
        bias = p.bias_n * math.tanh(b / 1e-4) ** 2 + p.viscous_bias * abs(b)
        r1 = p.rotor_kg * (a - s[1]) / h + p.viscous * (1.0 - p.thinning * warm) * a + link - drive_n
        r2 = p.table_kg * (b - s[3]) / h - link + rub + bias + load_n - p.push_n
        j11, j22 = p.rotor_kg / h + p.viscous + stiff, p.table_kg / h + stiff + slope * h
        det = j11 * j22 - stiff * stiff
        da, db = (r1 * j22 + r2 * stiff) / det, (r2 * j11 + r1 * stiff) / det
        a, b = a - da, b - db
        if abs(da) + abs(db) < NEWTON_ENOUGH:
            break
    yielded(p, slip, level, h * b, True)
    s[0] += h * a
    s[2] += h * b
    s[1], s[3] = a, b


@njit(cache=True)
def seen(p: Screw, x1: float, x2: float, warm: float, noise: Array, real: bool) -> tuple[float, float]:
    """Return what encoder and linear scale say, both in m; ideal counts and no `noise` (2,) unless `real`."""
    turn = 2.0 * math.pi / p.lead_m
    motor = x1 + p.off_centre_m * math.sin(turn * x1 + p.phase)
    scale = x2 * (1.0 + p.stretch + p.growth_1_k * 12.0 * warm) + p.wobble_m * math.sin(turn * x2 + p.phase)
    scale += p.grating_m * math.sin(2.0 * math.pi * x2 / p.grating_pitch_m + p.phase)
    if real:
        motor = round((motor + noise[0]) / p.encoder_m) * p.encoder_m
        scale = round((scale + noise[1]) / p.scale_m) * p.scale_m
    return motor, scale


@njit(cache=True)
def run(
    p: Screw, g: Gains, wanted: Array, period_s: float, noise: Array, warm: Array, foreign: Array, real: bool
) -> Array:
    """Follow `wanted` (n, 3: m, m/s, m/s²) and return (n, 3): encoder, force of the motor, scale.

    `noise` (n, 3) is that of encoder, scale and force; `warm` and `foreign` (N) are (n,).
    """
    n, h = len(wanted), period_s / STEPS_A_SAMPLE
    out = np.zeros((n, 3))
    slip, s = np.zeros(4), np.zeros(4)
    s[0] = s[2] = wanted[0, 0]
    before, integral, guess, old_speed = wanted[0, 0], 0.0, 0.0, 0.0
    low = 1.0 - math.exp(-g.observer_rad_s * period_s)
    force = 0.0
    for k in range(n):
        motor, scale = seen(p, s[0], s[2], warm[k], noise[k], real)
        out[k] = motor, force + (noise[k, 2] if real else 0.0), scale
        speed = (motor - before) / period_s if k else 0.0
        before = motor
        if k:
            guess += low * (force - g.mass_kg * (speed - old_speed) / period_s - guess)
        old_speed = speed
        error = wanted[k, 1] + g.position_1_s * (wanted[k, 0] - motor) - speed
        integral += g.integral_1_s * error * period_s
        force = g.velocity_n_s_m * (error + integral) + g.mass_kg * wanted[k, 2] + 0.3 * guess
        force = min(max(force, -4000.0), 4000.0)
        for _ in range(STEPS_A_SAMPLE):
            advance(p, s, slip, force, foreign[k], warm[k], h)
    return out
