"""Circles in the stream of rows: the last whole turn, what compensated it, its four reversals."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from servo_ctrl.experiment.circles import SPEED_TOLERANCE, last_turn
from servo_ctrl.learning.performance import Circle, circle_deviation, commanded_circle
from servo_ctrl.telemetry.contour_traces import ContourTrace

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

Kind = Literal["without", "pulse", "observer", "both"]
LABELS: dict[Kind, str] = {
    "without": "WFC: without",
    "pulse": "WTFC: trapezoidal pulse",
    "observer": "WDOB: observer",
    "both": "WTFC + WDOB",
}
QUADRANTS = ("+X", "+Y", "\N{MINUS SIGN}X", "\N{MINUS SIGN}Y")
"""Where on the circle an axis reverses, counterclockwise from the first axis' greatest position."""
AFTER_RAD, BEFORE_RAD = math.radians(25.0), math.radians(10.0)
"""A glitch is looked for so far behind its reversal, against the mean of the stretch before it."""
ON_CIRCLE = 1e-6
"""Commanded positions on a circle are so close to it, of its radius."""


class PlaneRows(NamedTuple):
    """Rows of the two axes of a plane, all (n,) or (n, 2); actual: the scale, else the motor."""

    cycle: Array
    segment: Array
    command_m: Array
    velocity_m_s: Array
    actual_m: Array
    pulse_m_s: Array
    disturbance_n: Array


class Turn(NamedTuple):
    """One whole turn of a circle."""

    kind: Kind
    circle: Circle
    """As commanded."""
    fitted: Circle
    """Through the actual positions, by least squares."""
    feed_m_s: float
    sense: int
    """+1 counterclockwise."""
    first_cycle: int
    last_cycle: int
    trace: ContourTrace
    """Radial errors to the commanded circle by the angle of the command."""
    fitted_trace: ContourTrace
    """The same, to the fitted circle."""

    @property
    def key(self) -> tuple[int, int, int]:
        """Turns of one key are one circle: radius in um, feed in mm/min, sense."""
        return round(self.circle.radius_m * 1e6), round(self.feed_m_s * 60e3), self.sense


def newest_turn(rows: PlaneRows, since_cycle: int) -> Turn | None:
    """The last whole turn at constant speed that ends with the newest rows of its step; None: there is none.

    Rows before `since_cycle` do not count: the machine was another one then.
    """
    part = _steady_end(rows, since_cycle)
    if part.stop - part.start < 8:
        return None
    command_m, actual_m = rows.command_m[part], rows.actual_m[part]
    try:
        circle = commanded_circle(command_m[:, 0], command_m[:, 1])
        deviation_m = circle_deviation(circle, actual_m[:, 0], actual_m[:, 1])
        off_m = circle_deviation(circle, command_m[:, 0], command_m[:, 1])
        if not np.abs(off_m).max() < ON_CIRCLE * circle.radius_m:
            return None
        trace = last_turn("", circle, command_m[:, 0], command_m[:, 1], deviation_m)
        turn = slice(part.stop - len(trace.angle_rad), part.stop)
        seen_m = rows.actual_m[turn]
        fitted = commanded_circle(seen_m[:, 0], seen_m[:, 1])
    except ValueError:
        return None
    kind = kind_of(rows.pulse_m_s[turn], rows.disturbance_n[turn])
    around = ContourTrace(LABELS[kind], trace.angle_rad, circle_deviation(fitted, seen_m[:, 0], seen_m[:, 1]))
    return Turn(
        kind=kind,
        circle=circle,
        fitted=fitted,
        feed_m_s=float(np.median(np.hypot(*rows.velocity_m_s[turn].T))),
        sense=1 if trace.angle_rad[-1] > trace.angle_rad[0] else -1,
        first_cycle=int(rows.cycle[turn.start]),
        last_cycle=int(rows.cycle[turn.stop - 1]),
        trace=trace._replace(label=LABELS[kind]),
        fitted_trace=around,
    )


def kind_of(pulse_m_s: Array, disturbance_n: Array) -> Kind:
    """By what acted on the axes during the turn, whatever was switched on."""
    pulse, observer = bool(np.nan_to_num(pulse_m_s).any()), bool(np.nan_to_num(disturbance_n).any())
    if pulse:
        return "both" if observer else "pulse"
    return "observer" if observer else "without"


def glitches_m(trace: ContourTrace) -> tuple[float, float, float, float]:
    """Heights of the errors behind the four reversals, outwards positive, in the order of QUADRANTS.

    The largest departure within AFTER_RAD behind it from the mean of the BEFORE_RAD before it.
    """
    heights = []
    for place in range(4):
        relative = since_reversal(trace.angle_rad, place)
        before = trace.radial_error_m[(relative >= -BEFORE_RAD) & (relative < 0.0)]
        after = trace.radial_error_m[(relative >= 0.0) & (relative <= AFTER_RAD)]
        if not len(before) or not len(after):
            heights.append(math.nan)
            continue
        departure = after - before.mean()
        heights.append(float(departure[np.argmax(np.abs(departure))]))
    return heights[0], heights[1], heights[2], heights[3]


def since_reversal(angle_rad: Array, place: int) -> Array:
    """How far behind a reversal, in the direction of motion, in [-pi, pi)."""
    sense = 1.0 if angle_rad[-1] > angle_rad[0] else -1.0
    return (sense * (angle_rad - 0.5 * math.pi * place) + math.pi) % (2.0 * math.pi) - math.pi


def _steady_end(rows: PlaneRows, since_cycle: int) -> slice:
    """The last consecutive rows at the constant speed of the newest step that moves."""
    speed_m_s = np.hypot(*rows.velocity_m_s.T)
    whole = np.isfinite(rows.command_m).all(axis=1) & np.isfinite(rows.actual_m).all(axis=1)
    usable = whole & (speed_m_s > 0.0) & (rows.cycle >= since_cycle)
    if not usable.any():
        return slice(0, 0)
    usable &= rows.segment == rows.segment[np.flatnonzero(usable)[-1]]
    feed_m_s = float(np.median(speed_m_s[usable]))  # the ramps of a step are short beside its steady part
    steady = usable & (np.abs(speed_m_s - feed_m_s) < SPEED_TOLERANCE * feed_m_s)
    steady[1:] &= np.diff(rows.cycle) == 1.0
    places = np.flatnonzero(steady)
    if not len(places):
        return slice(0, 0)
    stop = int(places[-1]) + 1
    broken = np.flatnonzero(~steady[:stop])
    return slice(int(broken[-1]) + 1 if len(broken) else 0, stop)
