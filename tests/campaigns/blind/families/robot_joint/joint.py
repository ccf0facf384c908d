"""Equations of motor and link about one axis, angles at the joint, split as Strang has it.

The bristles' equation is linear in their deflection while the speed is held, so its half steps are exact
exponentials however stiff it is; the masses take a classical Runge-Kutta step between them.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from tests.campaigns.blind.families.interface import Array

SPLITS = 10


class Joint(NamedTuple):
    """A true joint: kg m², N m, rad; what is 0 is absent."""

    rotor: float = 0.5
    link: float = 0.8
    spring: float = 2e4
    hardening: float = 1e9
    damper: float = 8.0
    viscous: float = 4.0
    dry: float = 5.0
    bristle_rad: float = 4e-5
    extra: float = 0.0
    extra_rad_s: float = 0.05
    favour: float = 0.0
    favour_viscous: float = 0.0
    grease: float = 0.0
    churn: float = 0.0
    patch: float = 0.0
    patch_rad: float = 0.6
    hanging: float = 0.0
    hanging_rad: float = 0.0
    pulled: float = 0.0
    hum: float = 0.0
    hum_hz: float = 10.0
    detent: float = 0.0
    uneven: float = 0.0
    teeth: float = 2.0
    """Periods of detent and uneven torque a turn of the joint."""
    phase: float = 0.0
    late: int = 0
    lag_s: float = 0.0
    gear: float = 100.0
    resolver_rad: float = 0.0
    """Error of the resolver, two periods a turn of the motor; as an angle at the joint."""
    count_rad: float = 1e-6


class Law(NamedTuple):
    """PD with an integral, feedforward of inertia and viscous friction, momentum observer."""

    p: float
    d: float
    i: float
    inertia: float
    viscous: float
    observer_1_s: float
    trust: float


@njit(cache=True)
def bristle_level(j: Joint, q: float, w: float, warm: float) -> float:
    """Friction of steady sliding in N m without its viscous part, the favoured direction included."""
    stribeck = j.extra * math.exp(-((w / j.extra_rad_s) ** 2))
    level = j.dry * (1.0 + j.patch * math.cos(q / j.patch_rad)) + stribeck
    return level * (1.0 - j.grease * warm) + j.favour * math.tanh(w / 1e-3)


@njit(cache=True)
def relaxed(j: Joint, z: float, q: float, w: float, warm: float, h: float) -> float:
    """Return the bristles' deflection in rad after `h` seconds of sliding at `w` rad/s, exactly."""
    if w == 0.0:
        return z
    stiff = j.dry / j.bristle_rad
    end = bristle_level(j, q, w, warm) / stiff * math.copysign(1.0, w)
    return end + (z - end) * math.exp(-abs(w) * h / abs(end))


@njit(cache=True)
def rates(
    j: Joint, s: Array, torque: float, z: float, outer: float, t: float, warm: float
) -> tuple[float, float]:
    """Return the accelerations of motor and link in rad/s² at `s` (rad, rad/s, rad, rad/s)."""
    twist = s[0] - s[2]
    link = j.spring * twist + j.hardening * twist**3 + j.damper * (s[1] - s[3])
    angle = j.teeth * s[0] + j.phase
    drive = torque * (1.0 + j.uneven * math.sin(angle)) + j.detent * math.sin(angle)
    slide = (
        j.viscous * (1.0 - j.grease * warm) * s[1] + j.favour_viscous * abs(s[1]) + j.churn * s[1] * abs(s[1])
    )
    rub = j.dry / j.bristle_rad * z + slide
    weight = j.hanging * math.sin(s[2] + j.hanging_rad)
    hum = j.hum * math.sin(2.0 * math.pi * j.hum_hz * t + j.phase)
    return (drive - rub - link) / j.rotor, (link - weight - outer + j.pulled + hum) / j.link


@njit(cache=True)
def kutta(j: Joint, s: Array, torque: float, z: float, outer: float, t: float, h: float, warm: float) -> None:
    """Advance the masses by a classical Runge-Kutta step with the bristles held."""
    k = np.zeros((5, 4))
    weights = (0.0, 0.5, 0.5, 1.0)
    total = np.zeros(4)
    for stage in range(4):
        at = s + weights[stage] * h * k[stage]
        a, b = rates(j, at, torque, z, outer, t + weights[stage] * h, warm)
        k[stage + 1] = np.array([at[1], a, at[3], b])
        total += k[stage + 1] * (2.0 if stage in (1, 2) else 1.0)
    s += h / 6.0 * total


@njit(cache=True)
def run(
    j: Joint, law: Law, wanted: Array, period_s: float, noise: Array, warm: Array, foreign: Array, real: bool
) -> Array:
    """Follow `wanted` (n, 3) and return (n, 3): motor's angle, torque commanded, torque of the current."""
    n, h = len(wanted), period_s / SPLITS
    out, s, sent = np.zeros((n, 3)), np.zeros(4), np.zeros(n)
    s[0] = s[2] = wanted[0, 0]
    z, total, actual, command, told, momentum, outside = 0.0, 0.0, 0.0, 0.0, wanted[0, 0], 0.0, 0.0
    for k in range(n):
        angle = s[0] + j.resolver_rad * math.sin(2.0 * j.gear * s[0] + j.phase)
        if real:
            angle = math.floor((angle + noise[k, 0]) / j.count_rad + 0.5) * j.count_rad
        out[k, 0], out[k, 1], out[k, 2] = angle, command, actual + noise[k, 1] * real
        w = (angle - told) / period_s
        told = angle
        momentum += (command - law.viscous * w + outside) * period_s
        outside = law.observer_1_s * (law.inertia * w - momentum)
        error = wanted[k, 0] - angle
        total += law.i * error * period_s
        command = law.p * error + total + law.d * (wanted[k, 1] - w)
        command += law.inertia * wanted[k, 2] + law.viscous * wanted[k, 1] - law.trust * outside
        sent[k] = command
        asked = sent[k - j.late] if k >= j.late else 0.0
        for m in range(SPLITS):
            actual += (asked - actual) * (1.0 - math.exp(-h / j.lag_s) if j.lag_s > 0.0 else 1.0)
            z = relaxed(j, z, s[0], s[1], warm[k], 0.5 * h)
            kutta(j, s, actual, z, foreign[k], k * period_s + m * h, h, warm[k])
            z = relaxed(j, z, s[0], s[1], warm[k], 0.5 * h)
    return out
