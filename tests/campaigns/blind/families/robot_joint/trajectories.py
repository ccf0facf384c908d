"""Trajectories of a joint: pick and place in random order, periodic excitation, slow passes, by hand."""

import math

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from tests.campaigns.blind.families.interface import Array


def sampled(curve: CubicSpline | PchipInterpolator, n: int, dt: float) -> Array:
    """Return angle, speed and acceleration of a curve in time (n, 3)."""
    t = np.arange(n) * dt
    return np.stack([curve(t, order) for order in range(3)], axis=1)


def stations(gen: np.random.Generator, sweep: float, fastest: float, n: int, dt: float) -> Array:
    """Return moves among a few stations in random order: half a cosine of speed, with pauses."""
    places = gen.uniform(-0.5, 0.5, 6) * sweep
    blocks, now, count = [np.zeros((int(0.3 / dt), 3))], 0.0, 0
    while count < n:
        goal = float(gen.choice(places))
        way = goal - now
        if abs(way) > 0.03:
            seconds = max(0.5 * math.pi * abs(way) / (fastest * gen.uniform(0.4, 1.0)), 0.25)
            s = np.arange(1, int(seconds / dt) + 1) * dt / seconds
            rate = math.pi / seconds
            blocks.append(
                np.stack(
                    (
                        now + way * (0.5 - 0.5 * np.cos(math.pi * s)),
                        way * 0.5 * rate * np.sin(math.pi * s),
                        way * 0.5 * rate**2 * np.cos(math.pi * s),
                    ),
                    axis=1,
                )
            )
            now = goal
        blocks.append(np.tile((now, 0.0, 0.0), (int(gen.uniform(0.05, 0.8) / dt), 1)))
        count = sum(len(block) for block in blocks)
    return np.concatenate(blocks)[:n]


def fourier(gen: np.random.Generator, sweep: float, fastest: float, n: int, dt: float) -> Array:
    """Return a periodic sum of harmonics of 0.1 Hz (Swevers 1997), begun within a second (n, 3)."""
    t = np.arange(n) * dt
    w = 2.0 * math.pi * 0.1 * np.arange(1, 9)
    c = gen.normal(size=8) / np.arange(1, 9) ** 0.7
    curve = np.sin(np.outer(t, w) + gen.uniform(0, 6.28, 8)) @ c
    curve = (
        (curve - curve[0])
        * np.clip(t, 0.0, 1.0) ** 3
        * (10.0 - 15.0 * np.clip(t, 0, 1) + 6.0 * np.clip(t, 0, 1) ** 2)
    )
    scale = min(0.5 * sweep / np.abs(curve).max(), fastest / np.abs(np.gradient(curve, dt)).max())
    return sampled(CubicSpline(t, scale * curve), n, dt)


def passes(gen: np.random.Generator, sweep: float, fastest: float, n: int, dt: float) -> Array:
    """Return passes to and fro at speeds drawn over two decades, as to measure friction (n, 3)."""
    knots, angles = [0.0, 0.4], [0.0, 0.0]
    while knots[-1] < n * dt:
        speed = fastest * 10.0 ** gen.uniform(-2.1, -0.1)
        way = min(0.45 * sweep, speed * gen.uniform(0.8, 2.0))
        for side in (1.0, -1.0, 0.0):
            knots.append(knots[-1] + max(abs(side * way - angles[-1]) / speed, 0.2))
            angles.append(side * way)
    t = np.arange(n + 400) * dt
    line = np.interp(t, knots, angles)
    bell = np.hanning(121) ** 2
    x = np.convolve(line, bell / bell.sum(), mode="same")[:n]
    v = np.gradient(x, dt)
    return np.stack((x, v, np.gradient(v, dt)), axis=1)


def guided(gen: np.random.Generator, sweep: float, fastest: float, n: int, dt: float) -> Array:
    """Return what a hand guides: smooth ways through drawn angles at uneven times (n, 3)."""
    angles = np.concatenate(([0.0, 0.0], gen.uniform(-0.45, 0.45, 60) * sweep))
    gaps = np.maximum(2.2 * np.abs(np.diff(angles)) / fastest, gen.uniform(0.25, 1.0, 61))
    knots = np.concatenate(([0.0], np.cumsum(gaps)))
    path = sampled(PchipInterpolator(knots, angles), n, dt)[:, 0]
    bell = np.hanning(161)
    x = np.convolve(np.pad(path, 80, mode="edge"), bell / bell.sum(), mode="valid")
    v = np.gradient(x, dt)
    return np.stack((x, v, np.gradient(v, dt)), axis=1)
