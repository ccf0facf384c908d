"""Equations of carriage and pulley, solved between two control instants by steps of varying length.

The belt's three lengths act as springs: the carriage's place decides how stiff it is (Hace, Jezernik and
Sabanovic 2005). Friction is Dahl's: a force that relaxes over a distance to its level.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from tests.campaigns.blind.families.interface import Array

TOLERANCE = 1e-7
"""Error of a step in m/s, and in m by 1e-3 of that: below what the sensors resolve."""
SHORTEST_S = 1e-6


class Belt(NamedTuple):
    """A true axis in SI at the belt; what is 0 is absent."""

    pulley_kg: float = 4.0
    carriage_kg: float = 8.0
    belt_n: float = 6e5
    """Stiffness of a metre of belt, E A."""
    half_m: float = 0.8
    damping: float = 200.0
    viscous: float = 15.0
    coulomb_n: float = 15.0
    dahl_m: float = 4e-5
    pulley_m: float = 0.15
    """Circumference of the pulley: travel of a turn."""
    sided_n: float = 0.0
    sided_n_s_m: float = 0.0
    square: float = 0.0
    rail: float = 0.0
    rail_at_m: float = 0.0
    rail_m: float = 0.1
    cold: float = 0.0
    incline_n: float = 0.0
    chain_n_m: float = 0.0
    detent_n: float = 0.0
    detent_turn: float = 6.0
    uneven: float = 0.0
    uneven_turn: float = 6.0
    shaker_n: float = 0.0
    shaker_hz: float = 10.0
    stretch: float = 0.0
    eccentric_m: float = 0.0
    phase: float = 0.0
    encoder_m: float = 1e-6
    carriage_count_m: float = 1e-6


class Pid(NamedTuple):
    """PID on the motor with acceleration and velocity feedforward, and a notch in series."""

    p: float
    i: float
    d: float
    mass_kg: float
    viscous: float
    notch_hz: float
    notch_width: float


@njit(cache=True)
def friction_level(p: Belt, x: float, v: float, warm: float) -> float:
    """Level of Dahl's friction in N at a place and speed."""
    rail = 1.0 + p.rail * math.exp(-(((x - p.rail_at_m) / p.rail_m) ** 2))
    return (p.coulomb_n * rail + (p.sided_n if v > 0.0 else -p.sided_n)) * (1.0 - p.cold * warm)


@njit(cache=True)
def slope(p: Belt, s: Array, drive_n: float, load_n: float, t: float, warm: float, d: Array) -> None:
    """Write the derivatives of `s` (pulley m, m/s, carriage m, m/s, friction N) into `d`."""
    x1, v1, x2, v2, rub = s[0], s[1], s[2], s[3], s[4]
    stiff = p.belt_n / (p.half_m + x2) + p.belt_n / (3.0 * p.half_m - x2)
    link = stiff * (x1 - x2) + p.damping * (v1 - v2)
    turn = 2.0 * math.pi / p.pulley_m
    motor = drive_n * (1.0 + p.uneven * math.sin(p.uneven_turn * turn * x1 + p.phase))
    motor += p.detent_n * math.sin(p.detent_turn * turn * x1 + p.phase)
    resist = p.viscous * v2 * (1.0 - p.cold * warm) + p.sided_n_s_m * abs(v2) + p.square * v2 * abs(v2)
    outer = p.incline_n - p.chain_n_m * x2 + p.shaker_n * math.sin(2.0 * math.pi * p.shaker_hz * t + p.phase)
    level = friction_level(p, x2, v2, warm)
    d[0], d[1] = v1, (motor - link) / p.pulley_kg
    d[2], d[3] = v2, (link - resist - rub - load_n + outer) / p.carriage_kg
    d[4] = p.coulomb_n / p.dahl_m * v2 * (1.0 - rub / level * (1.0 if v2 > 0.0 else -1.0))


@njit(cache=True)
def between(
    p: Belt, s: Array, drive_n: float, load_n: float, start_s: float, end_s: float, step_s: float, warm: float
) -> float:
    """Advance `s` from one instant to the other; return the length of step to begin the next with."""
    k1, k2, k3, k4 = np.empty(5), np.empty(5), np.empty(5), np.empty(5)
    t, h = start_s, step_s
    slope(p, s, drive_n, load_n, t, warm, k1)
    while t < end_s - 1e-12:
        h = min(h, end_s - t)
        slope(p, s + 0.5 * h * k1, drive_n, load_n, t + 0.5 * h, warm, k2)
        slope(p, s + 0.75 * h * k2, drive_n, load_n, t + 0.75 * h, warm, k3)
        new = s + h / 9.0 * (2.0 * k1 + 3.0 * k2 + 4.0 * k3)
        slope(p, new, drive_n, load_n, t + h, warm, k4)
        off = h * (-5.0 / 72.0 * k1 + k2 / 12.0 + k3 / 9.0 - k4 / 8.0)
        error = (abs(off[1]) + abs(off[3])) / TOLERANCE * 0.1 + (abs(off[0]) + abs(off[2])) / (
            TOLERANCE * 1e-2
        )
        error += abs(off[4]) / (0.01 * p.coulomb_n)
        if error <= 1.0 or h <= SHORTEST_S:
            t += h
            s[:] = new
            k1[:] = k4
        h = max(h * min(4.0, max(0.2, 0.9 * (error + 1e-12) ** (-1.0 / 3.0))), SHORTEST_S)
    return h


@njit(cache=True)
def run(
    p: Belt, c: Pid, wanted: Array, period_s: float, noise: Array, warm: Array, foreign: Array, real: bool
) -> Array:
    """Follow `wanted` (n, 3) and return (n, 3): encoder of the motor, its force, encoder of the carriage."""
    n = len(wanted)
    out, s = np.zeros((n, 3)), np.zeros(5)
    s[0] = s[2] = wanted[0, 0]
    w = 2.0 * math.pi * c.notch_hz * period_s
    pole = 1.0 - min(0.5 * c.notch_width * w, 0.6)
    gain = (1.0 - 2.0 * pole * math.cos(w) + pole * pole) / (2.0 - 2.0 * math.cos(w))
    u1, u2, y1, y2, total, last, force, step = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1e-5
    rate = 0.0
    for k in range(n):
        motor, load = s[0], s[2] * (1.0 + p.stretch)
        load += p.eccentric_m * math.sin(2.0 * math.pi / p.pulley_m * s[0] + p.phase)
        shown = force
        if real:
            motor = math.floor((motor + noise[k, 0]) / p.encoder_m) * p.encoder_m
            load = math.floor((load + noise[k, 1]) / p.carriage_count_m) * p.carriage_count_m
            shown += noise[k, 2]
        out[k, 0], out[k, 1], out[k, 2] = motor, shown, load
        error = wanted[k, 0] - motor
        if k == 0:
            last = error
        rate += 0.5 * ((error - last) / period_s - rate)
        last = error
        total += c.i * error * period_s
        u = c.p * error + total + c.d * rate
        y = gain * (u - 2.0 * math.cos(w) * u1 + u2) + 2.0 * pole * math.cos(w) * y1 - pole * pole * y2
        u2, u1, y2, y1 = u1, u, y1, y
        force = y + c.mass_kg * wanted[k, 2] + c.viscous * wanted[k, 1]
        step = between(p, s, force, foreign[k], k * period_s, (k + 1) * period_s, step, warm[k])
    return out
