"""Cycles of a tilting axis: indexing, swarf cutting, sines, holding, the test of ISO 230-2; (n, 3) each.

Each is a list of angles to stand at and of speeds between them, or a curve; speeds are rounded off by a
moving mean, as a numerical control bounds its jerk, so that angle, speed and acceleration agree exactly.
"""

import math

import numpy as np
from scipy.ndimage import uniform_filter1d

from tests.campaigns.blind.families.interface import Array

REST_S = 0.35
"""Least rest at either end, s; chosen."""
LONGEST_LEG = 0.3
"""Bounds the share of a course in one leg, which is faster than drawn then; chosen: one that is longer than
the course would leave it at rest."""


def smoothed(speed: Array, begin: float, period_s: float, ramp_s: float) -> Array:
    """Return angle, speed and acceleration of a course of speeds, each change of it spread over `ramp_s`."""
    window = max(round(0.6 * ramp_s / period_s), 1), max(round(0.4 * ramp_s / period_s), 1)
    for size in window:
        speed = uniform_filter1d(speed, size, mode="nearest")
    return np.stack((begin + np.cumsum(speed) * period_s, speed, np.gradient(speed, period_s)), axis=1)


def stops(legs: list[tuple[float, float, float]], n: int, period_s: float, ramp_s: float) -> Array:
    """Return a course of `legs`, each an angle in rad, speed to it in rad/s and rest there in s.

    It begins at the angle of the first.
    """
    speed, now, k = np.zeros(n), legs[0][0], round(REST_S / period_s)
    for goal, fast, rest_s in legs[1:]:
        size = min(max(round(abs(goal - now) / fast / period_s), 1), round(LONGEST_LEG * n))
        if k + size + round((ramp_s + REST_S) / period_s) > n:
            break
        speed[k : k + size] = (goal - now) / (size * period_s)
        now, k = goal, k + size + round((ramp_s + rest_s) / period_s)
    return smoothed(speed, legs[0][0], period_s, ramp_s)


def indexing(rng: np.random.Generator, low: float, high: float, fast: float, n: int, dt: float) -> Array:
    """Go from one of the equal divisions to another and dwell there, as for holes on a slanted face."""
    marks = np.linspace(low, high, int(rng.integers(3, 8)))
    legs, at = [(float(marks[0]), fast, 0.5)], 0
    for _ in range(80):
        at = (at + int(rng.integers(1, len(marks)))) % len(marks)
        legs.append((float(marks[at]), fast * rng.choice([0.3, 0.6, 1.0]), rng.uniform(0.2, 1.1)))
    return stops(legs, n, dt, rng.uniform(0.15, 0.35))


def swarf(rng: np.random.Generator, low: float, high: float, fast: float, n: int, dt: float) -> Array:
    """Follow the twist of a blade to and fro, slowly, with a rest at every turn of the way."""
    reach = (high - low) * rng.uniform(0.15, 0.4)
    root = rng.uniform(low, high - reach)
    twist, phase = rng.uniform(0.2, 0.6), rng.uniform(0.0, 2.0 * math.pi)
    speed, k, way = np.zeros(n), round(REST_S / dt), 1.0
    while True:
        slow = fast * 10.0 ** rng.uniform(-1.7, -0.6)
        size = min(round(reach / slow / dt), round(0.22 * n))
        if k + size + round(0.6 / dt) > n:
            break
        u = np.arange(size) / size
        speed[k : k + size] = way * slow * (1.0 + twist * np.sin(4.0 * math.pi * u + phase))
        # a pass that is cut short is gone back as far as it went
        back = slice(k, k + size)
        k += size + round(rng.uniform(0.3, 0.7) / dt)
        if k + size + round(0.6 / dt) > n:
            break
        speed[k : k + size] = -speed[back][::-1]
        k += size + round(rng.uniform(0.3, 0.7) / dt)
    return smoothed(speed, root, dt, 0.12)


def sines(rng: np.random.Generator, low: float, high: float, fast: float, n: int, dt: float) -> Array:
    """Swing about the middle with one frequency after another, at rest between them."""
    speed, k = np.zeros(n), round(REST_S / dt)
    while True:
        hertz = 0.15 * 14.0 ** rng.random()
        reach = min(0.45 * (high - low), fast * rng.uniform(0.3, 0.9) / (2.0 * math.pi * hertz))
        size = round(max(round(3.0 * hertz), 1) / hertz / dt)
        if k + size + round(0.5 / dt) > n:
            break
        t = np.arange(size) * dt
        speed[k : k + size] = reach * 2.0 * math.pi * hertz * np.cos(2.0 * math.pi * hertz * t)
        k += size + round(rng.uniform(0.3, 0.8) / dt)
    return smoothed(speed, 0.5 * (low + high), dt, 0.2)


def holding(rng: np.random.Generator, low: float, high: float, fast: float, n: int, dt: float) -> Array:
    """Stand at a few angles for long, as under a cut, and correct by some arc minutes in between."""
    at = rng.uniform(low, high)
    legs = [(at, fast, 1.0)]
    for _ in range(40):
        goal = float(rng.uniform(low, high))
        legs.append((goal, fast * 10.0 ** rng.uniform(-1.0, -0.1), rng.uniform(1.0, 2.0)))
        for _ in range(int(rng.integers(0, 3))):
            goal += float(rng.choice([-1.0, 1.0]) * rng.uniform(0.002, 0.01))
            legs.append((goal, 0.1 * fast, rng.uniform(0.4, 0.9)))
    return stops(legs, n, dt, 0.2)


def positioning(rng: np.random.Generator, low: float, high: float, fast: float, n: int, dt: float) -> Array:
    """Step through the travel and back, overrun at the ends, as ISO 230-2 measures; then faster over all."""
    marks = low + (high - low) * (np.arange(5) + rng.uniform(-0.2, 0.2, 5) + 0.5) / 5.0
    path = [*marks, high, *marks[::-1], low]
    legs = [(low, fast, 0.4)]
    for speed in rng.permutation([0.35, 1.0, 0.7]) * fast:
        legs += [(float(mark), float(speed), 0.3) for mark in path]
    return stops(legs, n, dt, 0.2)


CYCLES = (indexing, swarf, sines, holding, positioning)
