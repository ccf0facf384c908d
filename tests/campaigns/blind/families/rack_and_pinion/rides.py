"""Rides of a lift: pallet heights by sine-squared accelerations, inspection at a creep, a joystick."""

import math

import numpy as np
from scipy.signal import lfilter

from tests.campaigns.blind.families.interface import Array


def hoist(dice: np.random.Generator, height: float, fastest: float, samples: int, dt: float) -> Array:
    """Return rides between shelves: (n, 3), the acceleration a sine squared up and another down."""
    shelves = np.linspace(-0.45, 0.45, int(dice.integers(4, 9))) * height
    rows, here = [np.tile((0.0, 0.0, 0.0), (int(0.5 / dt), 1))], 0.0
    filled = len(rows[0])
    while filled < samples:
        there = float(dice.choice(shelves)) + dice.uniform(-0.01, 0.01)
        way = there - here
        if abs(way) < 0.02:
            continue
        top = min(fastest * dice.uniform(0.3, 1.0), abs(way) / 0.8)
        ramp, cruise = int(max(top / 2.0, 0.2) / dt), 0
        cruise = max(int((abs(way) / top) / dt) - ramp, 0)
        lift = np.sin(math.pi * (np.arange(ramp) + 0.5) / ramp) ** 2
        a = np.concatenate((lift, np.zeros(cruise), -lift))
        a *= way / (np.cumsum(np.cumsum(a))[-1] * dt**2)
        v = np.cumsum(a) * dt
        x = here + np.cumsum(v) * dt
        rest = int(dice.uniform(0.1, 1.0) / dt)
        rows.append(np.stack((x, v, a), axis=1))
        rows.append(np.tile((x[-1], 0.0, 0.0), (rest, 1)))
        here, filled = float(x[-1]), filled + len(x) + rest
    return np.concatenate(rows)[:samples]


def creep(dice: np.random.Generator, height: float, fastest: float, samples: int, dt: float) -> Array:
    """Return passes up and down at steady speeds over two decades, turned softly (n, 3)."""
    speed = np.empty(0)
    while len(speed) < samples:
        s = fastest * 10.0 ** dice.uniform(-2.0, -0.2)
        some = int(min(0.7 * height / s, dice.uniform(0.8, 2.2)) / 2.0 / dt)
        speed = np.concatenate((speed, np.full(some, s), np.full(2 * some, -s), np.full(some, s)))
    hann = np.hanning(int(0.2 / dt))
    v = np.convolve(speed[:samples], hann / hann.sum(), mode="same") * np.minimum(
        np.arange(samples) * dt / 0.3, 1.0
    )
    return np.stack((np.cumsum(v) * dt, v, np.gradient(v, dt)), axis=1)


def joystick(dice: np.random.Generator, height: float, fastest: float, samples: int, dt: float) -> Array:
    """Return what a hand does: speeds held for a while, drawn back to the middle of the travel (n, 3)."""
    target, x, asked = np.zeros(samples), 0.0, 0.0
    until = 0
    for k in range(samples):
        if k >= until:
            until = k + int(dice.uniform(0.3, 1.5) / dt)
            asked = fastest * dice.uniform(-0.8, 0.8) * (dice.random() > 0.25)
            if abs(x + 0.8 * asked) > 0.35 * height:
                asked = -math.copysign(abs(asked), x)
        target[k] = asked
        x += asked * dt
    keep = math.exp(-dt / 0.05)
    v = target
    for _ in range(3):
        v = lfilter([1.0 - keep], [1.0, -keep], v)
    return np.stack((np.cumsum(v) * dt, v, np.gradient(v, dt)), axis=1)
