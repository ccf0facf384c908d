"""Motions of a handling axis: pick and place by fifth-order polynomials, raster rows, tuning strokes."""

import math

import numpy as np

from tests.campaigns.blind.families.interface import Array


def fifth_order(start: float, end: float, count: int, period_s: float) -> Array:
    """Return a rest-to-rest polynomial with neither speed nor acceleration at its ends (count, 3)."""
    u, way, length_s = np.linspace(0.0, 1.0, count), end - start, count * period_s
    x = start + way * u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    v = way / length_s * 30.0 * u**2 * (1.0 - u) ** 2
    a = way / length_s**2 * 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u)
    return np.stack((x, v, a), axis=1)


def still(at: float, seconds: float, period_s: float) -> Array:
    """Return a rest (n, 3)."""
    return np.tile([at, 0.0, 0.0], (max(round(seconds / period_s), 1), 1))


def pick_and_place(
    rng: np.random.Generator, reach_m: float, fastest: float, n: int, period_s: float
) -> Array:
    """Return moves between drawn places, each as fast as its length allows, with rests of a gripper."""
    parts, at = [still(0.0, 0.4, period_s)], 0.0
    while sum(map(len, parts)) < n:
        to = rng.uniform(-0.5, 0.5) * reach_m
        speed = fastest * rng.choice([1.0, 0.6, 0.25])
        seconds = max(1.875 * abs(to - at) / speed, 0.18)
        parts += [
            fifth_order(at, to, round(seconds / period_s), period_s),
            still(to, rng.uniform(0.1, 0.7), period_s),
        ]
        at = to
    return np.concatenate(parts)[:n]


def raster(rng: np.random.Generator, reach_m: float, fastest: float, n: int, period_s: float) -> Array:
    """Return rows at one speed, turned by parabolas, the speed changing each few rows."""
    parts, at, side = [still(0.0, 0.3, period_s)], 0.0, 1.0
    acceleration = fastest * rng.uniform(4.0, 9.0)
    while sum(map(len, parts)) < n:
        speed, width = fastest * 10.0 ** rng.uniform(-1.3, 0.0), reach_m * rng.uniform(0.3, 0.5)
        to = side * width
        ramp = min(speed, math.sqrt(acceleration * abs(to - at)))
        up = max(round(ramp / acceleration / period_s), 2)
        flat = max(round((abs(to - at) - ramp * up * period_s) / ramp / period_s), 0)
        way = 1.0 if to > at else -1.0
        a = np.concatenate(
            (np.full(up, ramp / (up * period_s)), np.zeros(flat), np.full(up, -ramp / (up * period_s)))
        )
        v = np.cumsum(a) * period_s
        v[-1] = 0.0
        x = at + way * np.cumsum(v) * period_s
        parts.append(np.stack((x, way * v, way * a), axis=1))
        at, side = float(x[-1]), -side
        parts.append(still(at, rng.uniform(0.02, 0.3), period_s))
    return np.concatenate(parts)[:n]


def tuning(rng: np.random.Generator, reach_m: float, fastest: float, n: int, period_s: float) -> Array:
    """Return strokes about drifting places whose frequency rises, as for tuning a controller."""
    t = np.arange(n) * period_s
    low, high = rng.uniform(0.2, 0.4), rng.uniform(2.0, 5.0)
    rate = math.log(high / low) / t[-1]
    angle = 2.0 * math.pi * low * np.expm1(rate * t) / rate
    frequency = low * np.exp(rate * t)
    size = np.minimum(0.4 * reach_m, 0.5 * fastest / (2.0 * math.pi * frequency)) * np.minimum(t, 1.0)
    x = size * np.sin(angle)
    v = np.gradient(x, period_s)
    return np.column_stack((x, v, np.gradient(v, period_s)))
