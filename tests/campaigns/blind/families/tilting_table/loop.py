"""The drive: P of position, PI of speed, notch; an observer of the load, or its weight fed forward."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from tests.campaigns.blind.families.interface import Array
from tests.campaigns.blind.families.tilting_table.trunnion import (
    Trunnion,
    advance,
    air_gap_torque,
    load_torque,
    transmission_error,
)

TRUST = 0.7
"""Share of the observed load that the drive feeds forward; chosen."""


class Drive(NamedTuple):
    """What the drive is set to; torques and gains at the table."""

    position_1_s: float
    speed: float
    """N m s/rad."""
    reset_s: float
    inertia: float
    speed_filter_hz: float
    notch_hz: float
    """0: none."""
    observer_1_s: float
    """0: none."""
    weight: float
    weight_rad: float
    most: float
    """Bounds the torque, N m."""
    step: float
    """Step of the current's converter, N m."""
    motor_count: float
    table_count: float
    """Count of the table's encoder, rad."""


@njit(cache=True)
def notch_of(hz: float, period_s: float) -> tuple[float, float, float]:
    """Return the coefficients of a notch of damping 0.1 over 0.6, bilinear and warped to its frequency."""
    if hz <= 0.0:
        return 1.0, 0.0, 0.0
    k = math.tan(math.pi * hz * period_s)
    low = 1.0 + 1.2 * k + k * k
    return (1.0 + 0.2 * k + k * k) / low, 2.0 * (k * k - 1.0) / low, (1.0 - 0.2 * k + k * k) / low


@njit(cache=True)
def counted(value: float, count: float, real: bool) -> float:
    """Return what an encoder or a converter shows of `value`."""
    return math.floor(value / count + 0.5) * count if real else value


@njit(cache=True)
def follow(
    m: Trunnion, d: Drive, wanted: Array, period_s: float, pieces: int,
    noise: Array, outer: Array, warm: Array, real: bool,
) -> Array:  # fmt: skip
    """Follow `wanted` (n, 3) in rad, rad/s, rad/s² and return (n, 4).

    Columns: angle of the motor's encoder, torque asked, torque of the current, angle of the table's encoder.
    `noise` (n, 3): of either encoder in rad and of the current in N m; `outer` (n,) in N m; `warm` (n,), 0
    to 1.
    """
    n, h = len(wanted), period_s / pieces
    out, sent = np.zeros((n, 4)), np.zeros(n)
    carried = load_torque(m, wanted[0, 0], 0.0, 0.0)
    slack = 0.5 * m.play_rad * (1.0 if carried >= 0.0 else -1.0)
    begin = wanted[0, 0] + carried / m.mesh + slack + transmission_error(m, wanted[0, 0], wanted[0, 0])
    s, rub = np.array([begin, 0.0, wanted[0, 0], 0.0]), np.zeros((2, 3))
    rub[:, 2] = m.yield_rad
    asked, current, speed, seen_w, offset, last = carried, carried, 0.0, 0.0, 0.0, 0.0
    seen_load = carried if d.observer_1_s > 0.0 else 0.0
    b0, b1, b2 = notch_of(d.notch_hz, period_s)
    a2 = b0 + b2 - 1.0
    # brake released with the weight already carried
    total = carried - TRUST * seen_load - d.weight * math.sin(wanted[0, 0] + d.weight_rad)
    kept1, kept2 = (1.0 - b0) * carried, (b2 - a2) * carried
    keep = math.exp(-2.0 * math.pi * d.speed_filter_hz * period_s)
    late = round(m.late_s / period_s)
    for i in range(n):
        angle = s[0] + m.disc_rad * math.sin(m.gear * s[0] + m.phase)
        if i == 0:
            offset = angle - wanted[0, 0]  # the axis was referenced where it stands
        angle = counted(angle - offset + noise[i, 0] * real, d.motor_count, real)
        if i == 0:
            last = angle
        out[i, 0] = angle
        out[i, 1] = counted(asked, d.step, real)
        out[i, 2] = counted(current + noise[i, 2] * real, d.step, real)
        out[i, 3] = counted(s[2] + noise[i, 1] * real, d.table_count, real)
        raw = (angle - last) / period_s
        last = angle
        speed = keep * speed + (1.0 - keep) * raw
        if d.observer_1_s > 0.0:
            wrong = raw - seen_w
            seen_w += period_s * ((asked - seen_load) / d.inertia + 2.0 * d.observer_1_s * wrong)
            seen_load -= period_s * d.inertia * d.observer_1_s**2 * wrong
        wrong = d.position_1_s * (wanted[i, 0] - angle) + wanted[i, 1] - speed
        ahead = d.inertia * wanted[i, 2] + d.weight * math.sin(wanted[i, 0] + d.weight_rad)
        free = d.speed * wrong + total + ahead + TRUST * seen_load
        asked = b0 * free + kept1
        kept1, kept2 = b1 * free - b1 * asked + kept2, b2 * free - a2 * asked
        if abs(asked) < d.most:
            total += d.speed * wrong * period_s / d.reset_s
        asked = min(max(asked, -d.most), d.most)
        sent[i] = asked
        given = sent[i - late] if i >= late else sent[0]
        for p in range(pieces):
            current += (given - current) * (1.0 - math.exp(-h / m.lag_s) if m.lag_s > 0.0 else 1.0)
            drive = air_gap_torque(m, current, s[0])
            t = i * period_s + p * h
            carried = advance(m, s, rub, drive, carried, t, h, warm[i], outer[i])
    return out
