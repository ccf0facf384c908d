"""From the samples of a slow travel there and back to the deviations of the table in both directions.

Scale and encoder are latched at the same SYNC, so neither the moment nor the lag of the loop matters: the
scale's position is compared with where the table was led to when the motor was there.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.units import MM

ARRIVED_M = 1e-9
"""An end of the travel is reached within this, metres; chosen: more than rounding, below any scale."""
RAMP_S = 0.25
"""A travel's feed by its acceleration, seconds; chosen: many periods of a structure, not to excite it."""


class ScrewSettings(NamedTuple):
    """How to learn one axis; [axis.NAME.screw_compensation] in SI."""

    lower_m: float
    upper_m: float
    """The ends of the travel."""
    step_m: float
    """Largest distance of two nodes."""
    travels: int
    """There and back."""
    feed_m_s: float
    dwell_s: float
    """Rest at the ends."""
    limit_m: float
    """Bound of the correction. Lost motion is not larger, so a pass has taken it up after that distance."""


class ScrewTravel(NamedTuple):
    """A travel that learning asks for, there and back, and what is tried out in it."""

    stage: str
    """Either "travel": nothing compensates; or "check": what was learned does."""
    table: Array | None = None
    """(2, n): table positions and errors, metres."""
    lost_motion_m: float = 0.0


class Pass(NamedTuple):
    """The travel in one direction, (n,) each, in order."""

    led_m: Array
    """Where the table was led to: the motor's position, less the correction in it."""
    scale_m: Array
    """At the same instants."""


def nodes_m(settings: ScrewSettings) -> Array:
    """Positions at which deviations are taken: over the whole travel, evenly, 2 at least."""
    length_m = settings.upper_m - settings.lower_m
    count = max(math.ceil(length_m / settings.step_m - 1e-9), 1) + 1
    return np.linspace(settings.lower_m, settings.upper_m, count)


def run_in_nodes(settings: ScrewSettings) -> int:
    """So many nodes at its beginning a pass need not have read."""
    first, second, *_ = nodes_m(settings)
    return math.ceil(settings.limit_m / float(second - first)) + 1


def travel_s(settings: ScrewSettings) -> float:
    """How long a travel takes, seconds."""
    pass_s = (settings.upper_m - settings.lower_m) / settings.feed_m_s
    return 2.0 * (pass_s + 2.0 * RAMP_S + settings.dwell_s)


def passes_of(
    command_m: Array, correction_m: Array, motor_m: Array, scale_m: Array, settings: ScrewSettings
) -> tuple[Pass, Pass]:
    """The passes up and down of one travel, from the samples (n,) of its cycles.

    Each begins when the motor has moved by `limit_m`, so that the lost motion is taken up. Samples that are
    missing (NaN) are left out. Raises ValueError when the command has not gone up and down.
    """
    top = np.flatnonzero(command_m >= settings.upper_m - ARRIVED_M)
    bottom = np.flatnonzero(command_m <= settings.lower_m + ARRIVED_M)
    if not len(top) or not (bottom < top[0]).any() or not (bottom > top[-1]).any():
        raise ValueError("the command has not gone from the lower end to the upper one and back")
    begin, turn = int(bottom[bottom < top[0]][-1]), int(top[-1])
    up, down = (
        _pass(command_m[part], correction_m[part], motor_m[part], scale_m[part], sign, settings.limit_m)
        for part, sign in ((slice(begin, turn), 1.0), (slice(turn, len(command_m)), -1.0))
    )
    return up, down


def _pass(
    command_m: Array, correction_m: Array, motor_m: Array, scale_m: Array, sign: float, run_in_m: float
) -> Pass:
    """`sign`: direction. The motor lags: the correction in its position is that of a set point before."""
    good = np.isfinite(motor_m) & np.isfinite(scale_m) & np.isfinite(correction_m)
    if not good.any():
        raise ValueError("there are no samples of scale and encoder")
    motor_led_to_m = (command_m + correction_m)[good]
    corrections_m = np.interp(motor_m[good] * sign, motor_led_to_m * sign, correction_m[good])
    run_in = (motor_m[good] - motor_m[good][0]) * sign > run_in_m
    return Pass((motor_m[good] - corrections_m)[run_in], scale_m[good][run_in])


def deviations_m(up: Pass, down: Pass, settings: ScrewSettings) -> Array:
    """(2, nodes): scale less where the table was led to, moving up and down; NaN where a pass runs in.

    Raises ValueError where a node was not read that should have been.
    """
    nodes = nodes_m(settings)
    found_m = np.array([_means(one.led_m, one.scale_m - one.led_m, nodes) for one in (up, down)])
    run_in = run_in_nodes(settings)
    missing = ~np.isfinite(found_m)
    missing[0, :run_in] = missing[1, len(nodes) - run_in :] = False
    for name, absent in zip(("up", "down"), missing, strict=True):
        if absent.any():
            at_mm = nodes[int(np.argmax(absent))] / MM
            raise ValueError(
                f"on the way {name} nothing was read at {at_mm:.3f} mm: samples are missing, or the motor "
                "did not get there"
            )
    return found_m


def _means(at_m: Array, values: Array, nodes: Array) -> Array:
    """Mean of the values nearest to each node, weighted by the distance each stands for: 0 at rest.

    Where they do not lie about the node evenly (at an end never) the slope carries the mean to it.
    """
    found = np.full(len(nodes), np.nan)
    places = np.rint((at_m - nodes[0]) / (nodes[1] - nodes[0])).astype(np.int64)
    inside = (places >= 0) & (places < len(nodes))
    if inside.sum() < 2:
        return found
    at_m, values, places = at_m[inside], values[inside], places[inside]
    weights = np.abs(np.gradient(at_m))
    total = np.bincount(places, weights, len(nodes))
    read = np.flatnonzero(total > 0.0)
    if len(read) < 2:
        return found
    centres_m, means = (np.bincount(places, weights * of)[read] / total[read] for of in (at_m, values))
    found[read] = means + np.gradient(means, centres_m) * (nodes[read] - centres_m)
    return found
