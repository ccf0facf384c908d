"""Equation of the lift as Moreau writes it: velocities jump by impulses, friction is a set of them.

A step computes the velocity without dry friction, then takes as much of it as the largest impulse of friction
can: none is left where that suffices. Stiction is exact and needs neither a spring nor a threshold of speed.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from tests.campaigns.blind.families.interface import Array

INNER = 16
GRAVITY = 9.81


class Lift(NamedTuple):
    """A true lift in SI at the rack, upwards positive; what is 0 is absent."""

    mass_kg: float = 60.0
    viscous: float = 120.0
    dry_n: float = 40.0
    weight_n: float = 0.0
    static_n: float = 0.0
    static_m_s: float = 0.01
    up_n: float = 0.0
    by_load: float = 0.0
    rail_n: float = 0.0
    rail_m: float = 0.3
    cable_n: float = 0.0
    cable_m: float = 0.5
    air: float = 0.0
    oil: float = 0.0
    pinion_m: float = 0.2
    phase: float = 0.0
    cog_n: float = 0.0
    cogs: float = 8.0
    torque: float = 0.0
    torques: float = 5.0
    pitch: float = 0.0
    runout_m: float = 0.0
    wind_m_n: float = 2e-9
    swell_1_k: float = 0.0
    count_m: float = 1e-6
    tape_m: float = 1e-6


class Cascade(NamedTuple):
    """Position P in 1/s, velocity P in N s/m and I in 1/s, feedforward of mass and weight."""

    kv: float
    kp: float
    ki: float
    mass_kg: float
    weight_n: float


@njit(cache=True)
def dry_limits_n(p: Lift, x: float, v: float, drive_n: float, warm: float) -> tuple[float, float]:
    """Return the largest friction in N against a motion up, and down."""
    level = p.dry_n + p.by_load * abs(drive_n) + p.rail_n * math.sin(x / p.rail_m)
    level += p.static_n / (1.0 + (v / p.static_m_s) ** 2)
    thin = 1.0 - p.oil * warm
    return max(level * thin + p.up_n, 0.0), max(level * thin - p.up_n, 0.0)


@njit(cache=True)
def stepped(
    p: Lift, x: float, v: float, drive_n: float, load_n: float, warm: float, h: float
) -> tuple[float, float]:
    """Return place and velocity after `h` seconds under the motor's force and another, both upwards."""
    angle = 2.0 * math.pi * x / p.pinion_m + p.phase
    force = drive_n * (1.0 + p.torque * math.sin(p.torques * angle)) + p.cog_n * math.sin(p.cogs * angle)
    force += load_n - p.weight_n - p.cable_n * math.tanh(x / p.cable_m) - p.air * v * abs(v)
    free = v + h * force / p.mass_kg
    slowed = 1.0 + h * p.viscous * (1.0 - p.oil * warm) / p.mass_kg
    up, down = dry_limits_n(p, x, v, drive_n, warm)
    new = max(free - h * up / p.mass_kg, 0.0) if free > 0.0 else min(free + h * down / p.mass_kg, 0.0)
    new /= slowed
    return x + 0.5 * h * (v + new), new


@njit(cache=True)
def run(
    p: Lift, c: Cascade, wanted: Array, period_s: float, noise: Array, warm: Array, foreign: Array, real: bool
) -> Array:
    """Follow `wanted` (n, 3) and return (n, 3): encoder of the motor, its force, tape scale on the column."""
    n, h = len(wanted), period_s / INNER
    out = np.zeros((n, 3))
    x, v, total, force, wound = wanted[0, 0], 0.0, 0.0, c.weight_n, c.weight_n
    past = x
    turn = 2.0 * math.pi / p.pinion_m
    speed = 0.0
    for k in range(n):
        tape = x * (1.0 + p.pitch + p.swell_1_k * 15.0 * warm[k]) - p.wind_m_n * wound
        tape += p.runout_m * math.sin(turn * x + p.phase)
        seen = x
        if real:
            seen = math.floor((x + noise[k, 0]) / p.count_m + 0.5) * p.count_m
            tape = math.floor((tape + noise[k, 1]) / p.tape_m + 0.5) * p.tape_m
        out[k, 0], out[k, 1], out[k, 2] = seen, force + noise[k, 2] * real, tape
        if k == 0:
            past = seen
        speed += 0.4 * ((seen - past) / period_s - speed)
        past = seen
        e = wanted[k, 1] + c.kv * (wanted[k, 0] - seen) - speed
        total += c.ki * e * period_s
        force = c.kp * (e + total) + c.mass_kg * wanted[k, 2] + c.weight_n
        for _ in range(INNER):
            x, v = stepped(p, x, v, force, -foreign[k], warm[k], h)
            wound += h / 1e-3 * (force - wound)
    return out
