"""Set points of test and production motions: rectangular velocities, smoothed twice to bound jerk."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tests.campaigns.blind.arrays import Array

Random = np.random.Generator
Boxes = list[tuple[float, float]]


class Reach(NamedTuple):
    """Limits of an axis."""

    travel_m: float
    velocity_m_s: float
    acceleration_m_s2: float


TEST = ("slow", "reversals", "steps", "multisine", "travel", "speeds")
PRODUCTION = ("circle", "moves")


def set_points(kind: str, reach: Reach, duration_s: float, period_s: float, rng: Random) -> Array:
    """Return set points (n, 3), SI: position from 0 (the middle of the travel), velocity, acceleration."""
    n = round(duration_s / period_s)
    if kind in {"multisine", "circle", "reversals"}:
        return _waves(kind, reach, n, period_s, rng)
    boxes = {"slow": _slow, "steps": _steps, "travel": _travel, "speeds": _speeds, "moves": _moves}[kind]
    velocity = np.zeros(n)
    at = round(0.2 / period_s)
    for speed_m_s, span_s in boxes(reach, duration_s, rng):
        samples = max(round(span_s / period_s), 1)
        velocity[at : at + samples] = speed_m_s
        at += samples
        if at >= n:
            break
    fastest_m_s = float(np.abs(velocity).max())
    ramp = max(round(fastest_m_s / reach.acceleration_m_s2 / period_s), 3)
    jerk = max(ramp // 3, 2)
    for width in (ramp, jerk):
        velocity = np.convolve(velocity, np.ones(width) / width)[:n]
    position = np.concatenate(([0.0], np.cumsum(velocity)[:-1])) * period_s
    return np.stack((position, velocity, np.gradient(velocity, period_s)), axis=1)


def _waves(kind: str, reach: Reach, n: int, period_s: float, rng: Random) -> Array:
    t = np.arange(n) * period_s
    if kind == "multisine":
        hz = np.geomspace(0.3, rng.uniform(6.0, 12.0), 9) * rng.uniform(0.93, 1.07, 9)
        size = 1.0 / hz**1.5
    elif kind == "circle":
        hz, size = np.array([rng.uniform(0.15, 0.8)]), np.ones(1)
    else:
        hz, size = np.array([rng.uniform(0.5, 2.0)]), np.ones(1)
    w = 2.0 * np.pi * hz
    phase = rng.uniform(0.0, 2.0 * np.pi, len(hz)) if kind == "multisine" else np.array([-0.5 * np.pi])
    envelope = np.minimum(t / 1.5, 1.0) ** 2 * (3.0 - 2.0 * np.minimum(t / 1.5, 1.0))
    if kind == "reversals":
        envelope = envelope * np.exp(-3.5 * np.clip((t - 2.0) / t[-1], 0.0, 1.0))
    raw = np.sum(size[:, None] * np.sin(w[:, None] * t + phase[:, None]), axis=0) * envelope
    v, a = np.gradient(raw, period_s), np.gradient(np.gradient(raw, period_s), period_s)
    share = rng.uniform(0.3, 0.95)
    least = [
        share * reach.velocity_m_s / np.abs(v).max(),
        share * reach.acceleration_m_s2 / np.abs(a).max(),
        0.45 * reach.travel_m / np.abs(raw).max(),
    ]
    if kind == "reversals":
        least.append(rng.uniform(0.5e-3, 4e-3) / np.abs(raw).max())
    factor = min(least)
    return np.stack((raw, v, a), axis=1) * factor


def _slow(reach: Reach, duration_s: float, rng: Random) -> Boxes:
    """Return constant slow speeds, each in both directions."""
    boxes: Boxes = []
    spent_s = 0.0
    speeds = rng.permutation(np.geomspace(2e-4, 0.03, 9)) * rng.uniform(0.8, 1.25)
    while spent_s < duration_s:
        for speed_m_s in speeds:
            span_s = min(rng.uniform(0.6, 1.6), 0.3 * reach.travel_m / speed_m_s)
            boxes += [(speed_m_s, span_s), (-speed_m_s, span_s)]
            if rng.random() < 0.4:
                boxes.append((0.0, rng.uniform(0.1, 0.4)))
        spent_s = sum(span for _, span in boxes)
    return boxes


def _to_and_fro(
    reach: Reach, duration_s: float, next_move: Callable[[float], tuple[float, float, float]]
) -> Boxes:
    """Chain moves; `next_move(position)` gives the next position, its speed and the dwell."""
    boxes: Boxes = []
    here_m = spent_s = 0.0
    while spent_s < duration_s:
        there_m, speed_m_s, rest_s = next_move(here_m)
        there_m = min(max(there_m, -0.48 * reach.travel_m), 0.48 * reach.travel_m)
        stroke_m = there_m - here_m
        shortest_s = (abs(stroke_m) / reach.acceleration_m_s2) ** 0.5
        span_s = max(abs(stroke_m) / speed_m_s, shortest_s, 0.01)
        ramp_s = 1.4 * reach.velocity_m_s / reach.acceleration_m_s2
        boxes += [(stroke_m / span_s, span_s), (0.0, ramp_s + rest_s)]
        here_m = there_m
        spent_s += span_s + ramp_s + rest_s
    return boxes


def _steps(reach: Reach, duration_s: float, rng: Random) -> Boxes:
    """Return short moves with dwells of different lengths."""

    def move(here_m: float) -> tuple[float, float, float]:
        stroke_m = float(np.exp(rng.uniform(np.log(2e-5), np.log(2e-2)))) * (
            1.0 if rng.random() < 0.5 else -1.0
        )
        if abs(here_m + stroke_m) > 0.4 * reach.travel_m:
            stroke_m = -stroke_m
        rest_s = float(np.exp(rng.uniform(np.log(0.03), np.log(4.0))))
        return here_m + stroke_m, reach.velocity_m_s * rng.uniform(0.05, 0.6), rest_s

    return _to_and_fro(reach, duration_s, move)


def _travel(reach: Reach, duration_s: float, rng: Random) -> Boxes:
    """Return strokes over the whole travel, fast and slower."""

    def move(here_m: float) -> tuple[float, float, float]:
        side = -1.0 if here_m > 0.0 else 1.0
        return (
            side * reach.travel_m * rng.uniform(0.35, 0.48),
            reach.velocity_m_s * rng.uniform(0.4, 1.0),
            0.1,
        )

    return _to_and_fro(reach, duration_s, move)


def _speeds(reach: Reach, duration_s: float, rng: Random) -> Boxes:
    """Return constant speeds over the speed range, each in both directions."""

    def move(here_m: float) -> tuple[float, float, float]:
        speed_m_s = reach.velocity_m_s * float(np.exp(rng.uniform(np.log(0.03), 0.0)))
        stroke_m = min(speed_m_s * rng.uniform(0.5, 1.5), 0.85 * reach.travel_m)
        return (-0.5 if here_m > 0.0 else 0.5) * stroke_m, speed_m_s, 0.05

    return _to_and_fro(reach, duration_s, move)


def _moves(reach: Reach, duration_s: float, rng: Random) -> Boxes:
    """Return production: moves all over the travel at production speeds."""

    def move(_here_m: float) -> tuple[float, float, float]:
        place_m = reach.travel_m * rng.uniform(-0.45, 0.45)
        return place_m, reach.velocity_m_s * rng.choice([0.3, 0.6, 0.9]), rng.uniform(0.05, 1.0)

    return _to_and_fro(reach, duration_s, move)
