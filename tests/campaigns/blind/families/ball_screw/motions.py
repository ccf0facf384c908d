"""Motions of a milling table: jogs at set speeds, circles with a break, and a contour of lines and arcs."""

import math

import numpy as np
from scipy.ndimage import uniform_filter1d

from tests.campaigns.blind.families.interface import Array


def smooth(position: Array, period_s: float, window_s: float) -> Array:
    """Return position, velocity, acceleration (n, 3) after three moving averages, as a control has."""
    width = max(round(window_s / period_s), 3)
    x = position
    for _ in range(3):
        x = uniform_filter1d(x, width, mode="nearest")
    v = np.gradient(x, period_s)
    return np.stack((x, v, np.gradient(v, period_s)), axis=1)


def jogs(rng: np.random.Generator, travel_m: float, fastest_m_s: float, n: int, period_s: float) -> Array:
    """Return jogs at speeds from creeping to fast, with dwells between them (n, 3)."""
    position, at = [np.zeros(round(0.3 / period_s))], 0.0
    while sum(map(len, position)) < n:
        speed = fastest_m_s * 10.0 ** rng.uniform(-1.8, 0.0)
        most = min(travel_m, speed * 2.5)
        to = float(
            np.clip(at + rng.choice([-1.0, 1.0]) * rng.uniform(0.3, 1.0) * most, -travel_m / 2, travel_m / 2)
        )
        count = max(round(abs(to - at) / speed / period_s), 2)
        position += [np.linspace(at, to, count), np.full(round(rng.uniform(0.05, 0.6) / period_s), to)]
        at = to
    return smooth(np.concatenate(position)[:n], period_s, 0.04)


def circles(rng: np.random.Generator, travel_m: float, fastest_m_s: float, n: int, period_s: float) -> Array:
    """Return one axis of circles whose radius and feed change at each break (n, 3)."""
    position = [np.zeros(round(0.3 / period_s))]
    while sum(map(len, position)) < n:
        radius = rng.uniform(0.1, 0.45) * travel_m
        feed = fastest_m_s * rng.uniform(0.08, 0.8)
        angle = np.arange(0.0, 2.0 * math.pi * rng.integers(1, 3), feed * period_s / radius)
        lead = radius * (1.0 - np.cos(angle))
        position += [lead - lead[0], np.full(round(rng.uniform(0.1, 0.4) / period_s), lead[-1] - lead[0])]
        position[-2] = np.where(lead > travel_m / 2, travel_m - lead, lead)
        position[-1] = np.full(len(position[-1]), position[-2][-1])
    return smooth(np.concatenate(position)[:n], period_s, 0.03)


def contour(rng: np.random.Generator, travel_m: float, fastest_m_s: float, n: int, period_s: float) -> Array:
    """Return one axis of a pocket: rows of lines and half circles at a cutting feed (n, 3)."""
    feed, row = fastest_m_s * rng.uniform(0.15, 0.5), rng.uniform(0.3, 0.9) * travel_m
    s = np.arange(n) * period_s * feed
    x = np.abs((s / row) % 2.0 - 1.0) * row - 0.5 * row
    creep = 0.05 * travel_m * np.sin(2.0 * math.pi * s / rng.uniform(3.0, 9.0) / row)
    return smooth(x - x[0] + creep, period_s, 0.06)
