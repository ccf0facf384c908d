"""Finds the last whole turn of a circle in the rows, its compensation, and the glitches at its reversals."""

import math
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from kernels.arrays import Array
from servo_ctrl.hmi.languages.texts import word
from servo_ctrl.learning.performance import FittedCircle, circle_deviation, commanded_circle
from servo_ctrl.metrology.circles import SPEED_TOLERANCE, last_turn
from servo_ctrl.plots.contour_traces import ContourTrace

Compensation = Literal["without", "pulse", "observer", "both"]
"""What acted on the axes during a turn."""
LABELS: dict[Compensation, str] = {
    "without": word("without compensation"),
    "pulse": word("learned pulse"),
    "observer": word("disturbance observer"),
    "both": word("pulse and observer together"),
}
"""In the order in which they are listed."""
LETTERS: dict[Compensation, str] = {"without": "WTFC", "pulse": "WFC", "observer": "WDOB"}
"""What Feng et al. 2015 call them; a test holds them against the study and the docs."""
QUADRANTS = ("+X", "+Y", "\N{MINUS SIGN}X", "\N{MINUS SIGN}Y")
"""Where an axis reverses, counterclockwise from the greatest position of the first axis."""
AFTER_RAD, BEFORE_RAD = math.radians(25.0), math.radians(10.0)
"""Arcs after and before a reversal that contain the quadrant glitch and the error without it; chosen."""
ON_CIRCLE = 1e-6
"""Bound of the distance of commanded positions from a circle, as a share of its radius."""
MIN_ROWS = 8
"""Bounds the rows of a turn from below; chosen: fewer do not determine a circle."""
CircleKey: TypeAlias = tuple[int, int, int]
"""A circle as programs tell them apart: radius in um, feed in mm/min, direction."""


class PlaneRows(NamedTuple):
    """Rows of the two axes of a plane, (n,) or (n, 2); actual: the scale, or the motor without a scale."""

    cycle: Array
    segment: Array
    command_m: Array
    velocity_m_s: Array
    actual_m: Array
    pulse_m_s: Array
    disturbance_n: Array


class MeasuredTurn(NamedTuple):
    """One whole turn of a circle."""

    compensation: Compensation
    circle: FittedCircle
    """The commanded circle."""
    fitted: FittedCircle
    """The least-squares circle through the actual positions."""
    feed_m_s: float
    direction: int
    """+1: counterclockwise."""
    last_cycle: int
    trace: ContourTrace
    """Radial errors against the commanded circle, by the angle of the command."""
    fitted_trace: ContourTrace
    """The same against the fitted circle."""

    @property
    def key(self) -> CircleKey:
        """The circle; turns of the same one can be compared."""
        return round(self.circle.radius_m * 1e6), round(self.feed_m_s * 60e3), self.direction


def newest_turn(rows: PlaneRows, since_cycle: int) -> MeasuredTurn | None:
    """Return the last whole turn at constant speed that ends with its step's newest rows; None without one.

    Rows before `since_cycle` are ignored: the machine had other compensations then.
    """
    part = _constant_speed_end(rows, since_cycle)
    if part.stop - part.start < MIN_ROWS:
        return None
    command_m, actual_m = rows.command_m[part], rows.actual_m[part]
    try:
        circle = commanded_circle(command_m[:, 0], command_m[:, 1])
        deviation_m = circle_deviation(circle, actual_m[:, 0], actual_m[:, 1])
        off_circle_m = circle_deviation(circle, command_m[:, 0], command_m[:, 1])
        if not np.abs(off_circle_m).max() < ON_CIRCLE * circle.radius_m:
            return None
        trace = last_turn("", circle, command_m[:, 0], command_m[:, 1], deviation_m)
        turn = slice(part.stop - len(trace.angle_rad), part.stop)
        x_m, y_m = rows.actual_m[turn].T
        fitted = commanded_circle(x_m, y_m)
    except ValueError:  # too few rows, a line, or less than a turn
        return None
    compensation = compensation_in(rows.pulse_m_s[turn], rows.disturbance_n[turn])
    label = LABELS[compensation]
    return MeasuredTurn(
        compensation=compensation,
        circle=circle,
        fitted=fitted,
        feed_m_s=float(np.median(np.hypot(*rows.velocity_m_s[turn].T))),
        direction=1 if trace.angle_rad[-1] > trace.angle_rad[0] else -1,
        last_cycle=int(rows.cycle[turn.stop - 1]),
        trace=trace._replace(label=label),
        fitted_trace=ContourTrace(label, trace.angle_rad, circle_deviation(fitted, x_m, y_m)),
    )


def compensation_in(pulse_m_s: Array, disturbance_n: Array) -> Compensation:
    """Return the compensation that acted on the axes during the rows, whatever was switched on."""
    pulse, observer = bool(np.nan_to_num(pulse_m_s).any()), bool(np.nan_to_num(disturbance_n).any())
    if pulse:
        return "both" if observer else "pulse"
    return "observer" if observer else "without"


def glitches_m(trace: ContourTrace) -> tuple[float, float, float, float]:
    """Return the four quadrant glitches, metres, in the order of QUADRANTS, outwards positive.

    A height is the largest departure within AFTER_RAD after the reversal from the mean within BEFORE_RAD
    before it.
    """
    heights = []
    for number in range(4):
        relative = since_reversal(trace.angle_rad, number)
        before = trace.radial_error_m[(relative >= -BEFORE_RAD) & (relative < 0.0)]
        after = trace.radial_error_m[(relative >= 0.0) & (relative <= AFTER_RAD)]
        if not len(before) or not len(after):
            heights.append(math.nan)
            continue
        departure = after - before.mean()
        heights.append(float(departure[np.argmax(np.abs(departure))]))
    return heights[0], heights[1], heights[2], heights[3]


def since_reversal(angle_rad: Array, number: int) -> Array:
    """Return the angle since reversal `number` of QUADRANTS, in the direction of motion, in [-pi, pi)."""
    direction = 1.0 if angle_rad[-1] > angle_rad[0] else -1.0
    return (direction * (angle_rad - 0.5 * math.pi * number) + math.pi) % (2.0 * math.pi) - math.pi


def _constant_speed_end(rows: PlaneRows, since_cycle: int) -> slice:
    """Return the last consecutive rows at the constant speed of the newest step that moves."""
    speed_m_s = np.hypot(*rows.velocity_m_s.T)
    complete = np.isfinite(rows.command_m).all(axis=1) & np.isfinite(rows.actual_m).all(axis=1)
    usable = complete & (speed_m_s > 0.0) & (rows.cycle >= since_cycle)
    if not usable.any():
        return slice(0, 0)
    usable &= rows.segment == rows.segment[np.flatnonzero(usable)[-1]]
    # the median is the feed: the ramps of a step are short beside its part at constant speed
    feed_m_s = float(np.median(speed_m_s[usable]))
    constant = usable & (np.abs(speed_m_s - feed_m_s) < SPEED_TOLERANCE * feed_m_s)
    constant[1:] &= np.diff(rows.cycle) == 1.0
    places = np.flatnonzero(constant)
    if not len(places):
        return slice(0, 0)
    stop = int(places[-1]) + 1
    breaks = np.flatnonzero(~constant[:stop])
    return slice(int(breaks[-1]) + 1 if len(breaks) else 0, stop)
