"""Equations of worm shaft and table, angles at the table, by Newmark's average acceleration.

Either side rubs on an elastic element that yields (Prandtl; Dupont et al. 2002 with breakaway and steady
deflection equal): held, its torque is that of a spring; yielded, it is the level of Stribeck. The torque is
continuous where it yields and where the sliding stops, and both instants are located inside a step. Speed is
linear in time over a step, so the stop is exact; the yield is found by a secant.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from tests.campaigns.blind.families.interface import Array

MOST_EVENTS = 8
"""Bounds the events inside one step: a worm that hammers in its play takes the rest in one piece."""
MOST_CONTACTS = 4
"""Bounds the solutions of one step: the flanks touch, are free, or touch on the other side."""


class Trunnion(NamedTuple):
    """A true axis at the table: kg m², N m, rad, s; what is 0 is absent."""

    shaft: float = 8.0
    table: float = 12.0
    mesh: float = 1e7
    mesh_damper: float = 2e3
    play_rad: float = 0.0
    worm_viscous: float = 40.0
    seal_viscous: float = 5.0
    worm_dry: float = 40.0
    seal_dry: float = 10.0
    yield_rad: float = 4e-5
    held_damping: float = 0.15
    """Damping ratio of either side on its element below the yield."""
    loss: float = 0.0
    """Friction of the mesh over the torque that it carries."""
    mixed: float = 0.0
    mixed_rad_s: float = 0.05
    flank: float = 0.0
    """Torque that one flank rubs more, and the other less."""
    flank_viscous: float = 0.0
    churning: float = 0.0
    oil: float = 0.0
    """Exponent of Vogel's law over the whole warming."""
    brake: float = 0.0
    brake_rad: float = 0.0
    brake_width_rad: float = 0.5
    unbalance: float = 0.0
    unbalance_rad: float = 0.0
    balancer: float = 0.0
    """Torque of the counterbalance; forward is positive."""
    pump: float = 0.0
    pump_hz: float = 20.0
    detent: float = 0.0
    ripple: float = 0.0
    poles: float = 6.0
    """Periods of detent and ripple a turn of the motor."""
    saturation: float = 0.0
    """Share of the torque that is missing at `most`."""
    most: float = 1e3
    runout_rad: float = 0.0
    pitch: float = 0.0
    """Growth of the wheel's pitch error, rad/rad."""
    disc_rad: float = 0.0
    """Error of the motor's encoder, once a turn; as an angle at the table."""
    phase: float = 0.0
    gear: float = 90.0
    late_s: float = 0.0
    lag_s: float = 0.0


@njit(cache=True)
def worm_level(m: Trunnion, angle: float, speed: float, carried: float, way: float, warm: float) -> float:
    """Yield of the worm's side in N m: mesh and brake, at `warm` from 0 to 1."""
    film = math.exp(-m.oil * warm)
    mixed = m.mixed * math.exp(-((abs(speed) / m.mixed_rad_s) ** 1.4))
    rubbing = m.brake * math.exp(-(((angle - m.brake_rad) / m.brake_width_rad) ** 2))
    level = (m.worm_dry + mixed) * (0.4 + 0.6 * film) + rubbing + m.loss * abs(carried) + way * m.flank
    return max(level, 1e-6)


@njit(cache=True)
def transmission_error(m: Trunnion, shaft: float, table: float) -> float:
    """Angle by which the table lags behind the worm shaft without load, rad."""
    worm = math.sin(m.gear * shaft + m.phase)
    return m.runout_rad * (worm + 2.0 * math.sin(table - m.phase)) + m.pitch * table


@njit(cache=True)
def load_torque(m: Trunnion, angle: float, t: float, outer: float) -> float:
    """Torque in N m that pulls the table backward: weight, counterbalance, pump and what is foreign."""
    weight = m.unbalance * math.sin(angle + m.unbalance_rad)
    return weight - m.balancer - m.pump * math.sin(2.0 * math.pi * m.pump_hz * t + m.phase) + outer


@njit(cache=True)
def air_gap_torque(m: Trunnion, asked: float, shaft: float) -> float:
    """Torque of the motor at the table in N m, of the current that stands for `asked`."""
    turn = m.poles * m.gear * shaft + m.phase
    real = asked * (1.0 - m.saturation * (asked / m.most) ** 2)
    return real * (1.0 + m.ripple * math.sin(turn)) + m.detent * math.sin(turn)


@njit(cache=True)
def touching(m: Trunnion, twist: float) -> float:
    """Return on which flank the worm and the wheel touch, 0 inside the play."""
    if abs(twist) < 0.5 * m.play_rad:
        return 0.0
    return math.copysign(1.0, twist)


@njit(cache=True)
def attempt(
    m: Trunnion,
    s: Array,
    rub: Array,
    level: Array,
    drag: float,
    drive: float,
    load: float,
    error: float,
    h: float,
) -> tuple[float, float, float, float, float]:
    """Return angles and speeds after `h` seconds and the mesh's torque, no element changing its state.

    `s` holds angle and speed of the shaft and of the table; `rub` for either the deflection in rad and the
    direction of sliding, 0 where held; levels, viscous `drag` of the worm in N m s/rad, `drive`, `load` and
    `error` are kept over the step.
    """
    q, r = 0.25 * h * h, 0.5 * h
    side = touching(m, s[0] - s[2] - error)
    k0 = level[0] / rub[0, 2] if rub[0, 1] == 0.0 else 0.0
    k1 = level[1] / rub[1, 2] if rub[1, 1] == 0.0 else 0.0
    fixed0 = drive - m.flank_viscous * abs(s[1]) - level[0] * rub[0, 1] - k0 * rub[0, 0]
    fixed1 = -load - level[1] * rub[1, 1] - k1 * rub[1, 0]
    d0 = drag + 2.0 * m.held_damping * math.sqrt(k0 * m.shaft)
    d1 = m.seal_viscous + 2.0 * m.held_damping * math.sqrt(k1 * m.table)
    k, c = m.mesh * abs(side), m.mesh_damper * abs(side)
    carried = k * (s[0] - s[2] - error - 0.5 * side * m.play_rad) + c * (s[1] - s[3])
    a0 = (fixed0 - d0 * s[1] - carried) / m.shaft
    a1 = (fixed1 - d1 * s[3] + carried) / m.table
    slow0, slow1 = s[1] + r * a0, s[3] + r * a1
    far0, far1 = h * s[1] + q * a0, h * s[3] + q * a1
    x0, v0, x1, v1 = s[0], s[1], s[2], s[3]
    for _ in range(MOST_CONTACTS):
        k, c = m.mesh * abs(side), m.mesh_damper * abs(side)
        free = error + 0.5 * side * m.play_rad
        bind = k * q + c * r
        known = k * (s[0] + far0 - s[2] - far1 - free) + c * (slow0 - slow1)
        y0 = fixed0 - k0 * far0 - d0 * slow0 - known
        y1 = fixed1 - k1 * far1 - d1 * slow1 + known
        m0, m1 = m.shaft + k0 * q + d0 * r + bind, m.table + k1 * q + d1 * r + bind
        det = m0 * m1 - bind * bind
        e0, e1 = (m1 * y0 + bind * y1) / det, (bind * y0 + m0 * y1) / det
        x0, v0, x1, v1 = s[0] + far0 + q * e0, slow0 + r * e0, s[2] + far1 + q * e1, slow1 + r * e1
        carried = k * (x0 - x1 - free) + c * (v0 - v1)
        now = touching(m, x0 - x1 - error)
        if now == side:
            break
        side = now
    return x0, v0, x1, v1, carried


@njit(cache=True)
def first_event(s: Array, rub: Array, ends: tuple[float, float, float, float]) -> tuple[int, float]:
    """Return which side yields or stops first, -1 where none does, and at what share of the step."""
    which, share = -1, 1.0
    for n in range(2):
        x, v, way, bent = ends[2 * n], ends[2 * n + 1], rub[n, 1], rub[n, 0]
        at = 2.0
        if way != 0.0 and v * way < 0.0:
            before = s[2 * n + 1]
            at = before / (before - v) if before * way > 0.0 else 0.0
        elif way == 0.0:
            moved = x - s[2 * n]
            if abs(bent + moved) > rub[n, 2] and moved * (bent + moved) > 0.0:
                at = max((math.copysign(rub[n, 2], bent + moved) - bent) / moved, 0.0)
        if at < share:
            which, share = n, at
    return which, share


@njit(cache=True)
def advance(
    m: Trunnion,
    s: Array,
    rub: Array,
    drive: float,
    carried: float,
    t: float,
    h: float,
    warm: float,
    outer: float,
) -> float:
    """Advance `s` and `rub` in place by `h` seconds and return the torque that the mesh carries.

    `rub` (2, 3): deflection in rad, direction of sliding, deflection at the yield in rad.
    """
    left, level = h, np.zeros(2)
    drag = m.worm_viscous * math.exp(-m.oil * warm) + m.churning * abs(s[1])
    for event in range(MOST_EVENTS + 1):
        way = rub[0, 1] if rub[0, 1] != 0.0 else math.copysign(1.0, rub[0, 0])
        level[0] = worm_level(m, s[2], s[1], carried, way, warm)
        level[1] = m.seal_dry
        error, load = transmission_error(m, s[0], s[2]), load_torque(m, s[2], t, outer)
        x0, v0, x1, v1, torque = attempt(m, s, rub, level, drag, drive, load, error, left)
        which, share = first_event(s, rub, (x0, v0, x1, v1))
        step = left
        if which >= 0 and event < MOST_EVENTS:
            step = share * left
            x0, v0, x1, v1, torque = attempt(m, s, rub, level, drag, drive, load, error, step)
        for n in range(2):
            if rub[n, 1] == 0.0:
                rub[n, 0] += (x0, x1)[n] - s[2 * n]
                rub[n, 0] = min(max(rub[n, 0], -rub[n, 2]), rub[n, 2])
        s[0], s[1], s[2], s[3] = x0, v0, x1, v1
        carried, left, t = torque, left - step, t + step
        if which < 0 or event == MOST_EVENTS:
            break
        if rub[which, 1] == 0.0:
            rub[which, 1] = math.copysign(1.0, rub[which, 0])
        else:
            rub[which, 0], rub[which, 1] = rub[which, 1] * rub[which, 2], 0.0
    return carried
