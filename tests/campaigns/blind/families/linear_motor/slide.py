"""Equations of the slide between control instants: it slips by Heun's rule until its speed crosses zero.

There it stops, at the instant of the crossing, and rests for as long as the other forces stay below breakaway
(Karnopp 1985); both instants are found within a step. Breakaway grows with the logarithm of the rest.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from tests.campaigns.blind.families.interface import Array

STEPS_A_SAMPLE = 5
STRIBECK_M_S = 0.003


class Slide(NamedTuple):
    """A true slide in SI; what is 0 is absent."""

    mass_kg: float = 12.0
    viscous: float = 20.0
    coulomb_n: float = 6.0
    extra_n: float = 0.0
    """Breakaway above Coulomb's level, lost over `fall_m_s`."""
    fall_m_s: float = STRIBECK_M_S
    ageing_n: float = 0.0
    """Growth of breakaway by a rest of e - 1 times `young_s`."""
    young_s: float = 0.1
    forward_n: float = 0.0
    drag: float = 0.0
    hose_n: float = 0.0
    hose_m: float = 0.1
    tilt_n: float = 0.0
    teeth_n: float = 0.0
    teeth: float = 6.0
    ripple: float = 0.0
    ripples: float = 2.0
    pair_m: float = 0.032
    phase: float = 0.0
    iron_n: float = 0.0
    """Force at which the magnets give 29 % less than in proportion."""
    dead_n: float = 0.0
    slow_s: float = 0.0
    late: int = 0
    """Control periods between command and current."""
    pump_n: float = 0.0
    pump_hz: float = 7.0
    dust: float = 0.0
    dust_m: float = 0.05


class Servo(NamedTuple):
    """PID on position with feedforward of acceleration and speed, and a low pass of the derivative."""

    p: float
    i: float
    d: float
    filter_s: float
    mass_kg: float
    viscous: float


@njit(cache=True)
def motor_n(p: Slide, u: float, x: float) -> float:
    """Force of the magnets in N for a current that is worth `u` N."""
    if p.dead_n > 0.0:
        u = math.copysign(max(abs(u) - p.dead_n, 0.0), u)
    if p.iron_n > 0.0:
        u /= math.sqrt(1.0 + (u / p.iron_n) ** 2)
    angle = 2.0 * math.pi * x / p.pair_m + p.phase
    return u * (1.0 + p.ripple * math.sin(p.ripples * angle)) + p.teeth_n * math.sin(p.teeth * angle)


@njit(cache=True)
def other_n(p: Slide, u: float, x: float, t: float, outer: float) -> float:
    """All forces on the slide in N but those of its speed."""
    hose = p.hose_n * math.tanh(x / p.hose_m)
    pump = p.pump_n * math.sin(2.0 * math.pi * p.pump_hz * t + p.phase)
    return motor_n(p, u, x) - hose + p.tilt_n + pump - outer


@njit(cache=True)
def rub_n(p: Slide, x: float, v: float, extra: float) -> float:
    """Friction in N of a slide that slips in the direction of `v`, with `extra` breakaway left by a rest."""
    side = 1.0 if v > 0.0 else -1.0
    fall = math.exp(-((v / p.fall_m_s) ** 2))
    level = p.coulomb_n * (1.0 + p.dust * math.sin(x / p.dust_m)) + p.extra_n * fall + extra * fall
    return side * level + p.forward_n + p.viscous * v + p.drag * v * abs(v)


@njit(cache=True)
def advance(p: Slide, s: Array, u: float, t: float, h: float, outer: float) -> None:
    """Advance `s` (m, m/s, rest in s, breakaway left in N) by h seconds under a current worth `u` N."""
    left = h
    for _ in range(4):
        push = other_n(p, u, s[0], t, outer)
        if s[1] == 0.0:
            extra = p.ageing_n * math.log1p(s[2] / p.young_s)
            level = p.coulomb_n * (1.0 + p.dust * math.sin(s[0] / p.dust_m))
            if abs(push - p.forward_n) <= level + p.extra_n + extra:
                s[2] += left
                return
            s[3], s[2] = extra, 0.0
            s[1] = math.copysign(1e-12, push - p.forward_n)
        a = (push - rub_n(p, s[0], s[1], s[3])) / p.mass_kg
        guess = s[1] + left * a
        if guess * s[1] > 0.0:
            b = (
                other_n(p, u, s[0] + left * s[1], t + left, outer) - rub_n(p, s[0] + left * s[1], guess, s[3])
            ) / p.mass_kg
            new = s[1] + 0.5 * left * (a + b)
            if new * s[1] > 0.0:
                s[0] += 0.5 * left * (s[1] + new)
                s[1] = new
                return
            a = 0.5 * (a + b)
        used = min(max(-s[1] / a, 0.0), left) if a != 0.0 else left
        s[0] += 0.5 * used * s[1]
        s[1] = 0.0
        left -= used
        t += used
        if left <= 0.0:
            return


@njit(cache=True)
def run(
    p: Slide,
    c: Servo,
    wanted: Array,
    period_s: float,
    noise: Array,
    foreign: Array,
    quadrature: Array,
    real: bool,
) -> Array:
    """Follow `wanted` (n, 3) and return (n, 4): encoder, command, current worth in N, speed of the slide.

    `quadrature` is (lines' period in m, two offsets, gain error, phase error) of the sine-cosine encoder.
    """
    h, n = period_s / STEPS_A_SAMPLE, len(wanted)
    out, s, queue = np.zeros((n, 4)), np.zeros(4), np.zeros(64)
    s[0] = wanted[0, 0]
    total, last, rate, current, command = 0.0, 0.0, 0.0, 0.0, 0.0
    line = quadrature[0]
    for k in range(n):
        angle = 2.0 * math.pi * s[0] / line
        seen = s[0]
        if real:
            sine = math.sin(angle) + quadrature[1]
            cosine = (1.0 + quadrature[3]) * math.cos(angle + quadrature[4]) + quadrature[2]
            turned = math.atan2(sine, cosine) - angle
            turned -= 2.0 * math.pi * math.floor(turned / (2.0 * math.pi) + 0.5)
            seen += line * turned / (2.0 * math.pi) + noise[k, 0]
            seen = math.floor(seen / (line / 4096.0)) * line / 4096.0
        out[k] = seen, command, current + (noise[k, 1] if real else 0.0), s[1]
        error = wanted[k, 0] - seen
        if k == 0:
            last = error
        rate += period_s / (c.filter_s + period_s) * ((error - last) / period_s - rate)
        last = error
        total = total + c.i * error * period_s
        command = c.p * error + total + c.d * rate + c.mass_kg * wanted[k, 2] + c.viscous * wanted[k, 1]
        queue[k % 64] = command
        asked = queue[(k - p.late) % 64] if k >= p.late else 0.0
        for j in range(STEPS_A_SAMPLE):
            if p.slow_s > 0.0:
                current += (1.0 - math.exp(-h / p.slow_s)) * (asked - current)
            else:
                current = asked
            advance(p, s, current, k * period_s + j * h, h, foreign[k])
    return out
