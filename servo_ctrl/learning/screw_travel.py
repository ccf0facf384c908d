"""Computes deviations of the table in both directions from the samples of a slow travel there and back.

Scale and encoder are latched at the same SYNC, so the lag of the loop has no effect: the scale position is
compared with the table position that was commanded for the motor's actual position.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.units import MM

END_TOLERANCE_M = 1e-9
"""Tolerance for the ends of the travel, metres; chosen: above rounding, below the resolution of any scale."""
RAMP_S = 0.25
"""Duration of the ramps of a travel, seconds; chosen: many periods of a structure, so as not to excite it."""


class ScrewSettings(NamedTuple):
    """How to learn one axis; [axis.NAME.screw_compensation] in SI."""

    lower_m: float
    upper_m: float
    """Upper end of the travel; `lower_m`: its lower end."""
    step_m: float
    """Largest distance between nodes."""
    travels: int
    """Number of travels there and back."""
    feed_m_s: float
    dwell_s: float
    """Dwell at the ends."""
    limit_m: float
    """Bound of the correction and of the lost motion, which a pass has taken up after this distance."""


class ScrewTravel(NamedTuple):
    """A travel there and back that learning requests, and the compensation to apply in it."""

    stage: str
    """Either "travel": without compensation; or "check": with the learned table."""
    table: Array | None = None
    """(2, n): table positions and errors, metres."""
    lost_motion_m: float = 0.0


class Pass(NamedTuple):
    """Samples of a travel in one direction, (n,) each, in order."""

    nominal_m: Array
    """Table position commanded for the motor's position: that position minus the correction in it."""
    scale_m: Array
    """Scale position at the same instants."""


def nodes_m(settings: ScrewSettings) -> Array:
    """Positions at which deviations are evaluated: equidistant over the whole travel, at least 2."""
    length_m = settings.upper_m - settings.lower_m
    count = max(math.ceil(length_m / settings.step_m - 1e-9), 1) + 1
    return np.linspace(settings.lower_m, settings.upper_m, count)


def run_in_nodes(settings: ScrewSettings) -> int:
    """Number of nodes at the start of a pass that may be missing."""
    first, second, *_ = nodes_m(settings)
    return math.ceil(settings.limit_m / float(second - first)) + 1


def travel_s(settings: ScrewSettings) -> float:
    """Duration of a travel, seconds."""
    pass_s = (settings.upper_m - settings.lower_m) / settings.feed_m_s
    return 2.0 * (pass_s + 2.0 * RAMP_S + settings.dwell_s)


def passes_of(
    command_m: Array, correction_m: Array, motor_m: Array, scale_m: Array, settings: ScrewSettings
) -> tuple[Pass, Pass]:
    """Split the samples (n,) of one travel into the passes up and down.

    Each pass begins when the motor has moved by `limit_m`, so that the lost motion is taken up. Missing
    samples (NaN) are omitted. Raises ValueError when the command did not go up and down.
    """
    top = np.flatnonzero(command_m >= settings.upper_m - END_TOLERANCE_M)
    bottom = np.flatnonzero(command_m <= settings.lower_m + END_TOLERANCE_M)
    if not len(top) or not (bottom < top[0]).any() or not (bottom > top[-1]).any():
        raise ValueError("the command has not gone from the lower end to the upper one and back")
    begin, turn = int(bottom[bottom < top[0]][-1]), int(top[-1])
    up, down = (
        _pass(
            command_m[part],
            correction_m[part],
            motor_m=motor_m[part],
            scale_m=scale_m[part],
            sign=sign,
            run_in_m=settings.limit_m,
        )
        for part, sign in ((slice(begin, turn), 1.0), (slice(turn, len(command_m)), -1.0))
    )
    return up, down


def _pass(
    command_m: Array, correction_m: Array, motor_m: Array, scale_m: Array, sign: float, run_in_m: float
) -> Pass:
    """One pass in the direction `sign`. The motor lags, so its position contains an earlier correction."""
    complete = np.isfinite(motor_m) & np.isfinite(scale_m) & np.isfinite(correction_m)
    if not complete.any():
        raise ValueError("there are no samples of scale and encoder")
    motor_set_point_m = (command_m + correction_m)[complete]
    corrections_m = np.interp(motor_m[complete] * sign, motor_set_point_m * sign, correction_m[complete])
    run_in = (motor_m[complete] - motor_m[complete][0]) * sign > run_in_m
    return Pass((motor_m[complete] - corrections_m)[run_in], scale_m[complete][run_in])


def deviations_m(up: Pass, down: Pass, settings: ScrewSettings) -> Array:
    """Scale minus nominal position at the nodes, moving up and down, (2, nodes); NaN where a pass starts.

    Raises ValueError where a later node has no samples.
    """
    nodes = nodes_m(settings)
    deviation_m = np.array(
        [_node_means(one.nominal_m, one.scale_m - one.nominal_m, nodes) for one in (up, down)]
    )
    run_in = run_in_nodes(settings)
    missing = ~np.isfinite(deviation_m)
    missing[0, :run_in] = missing[1, len(nodes) - run_in :] = False
    for name, absent in zip(("up", "down"), missing, strict=True):
        if absent.any():
            at_mm = nodes[int(np.argmax(absent))] / MM
            raise ValueError(
                f"on the travel {name} nothing was read at {at_mm:.3f} mm: samples are missing, or the motor "
                "did not get there"
            )
    return deviation_m


def _node_means(at_m: Array, values: Array, nodes: Array) -> Array:
    """Mean (nodes,) of the values nearest to each node, weighted by the distance each sample covers.

    Where the samples are not centred on the node, as at the ends, the mean is extrapolated by the slope.
    """
    at_nodes = np.full(len(nodes), np.nan)
    places = np.rint((at_m - nodes[0]) / (nodes[1] - nodes[0])).astype(np.int64)
    inside = (places >= 0) & (places < len(nodes))
    if inside.sum() < 2:
        return at_nodes
    at_m, values, places = at_m[inside], values[inside], places[inside]
    weights = np.abs(np.gradient(at_m))
    total = np.bincount(places, weights, len(nodes))
    read = np.flatnonzero(total > 0.0)
    if len(read) < 2:
        return at_nodes
    centres_m, means = (np.bincount(places, weights * of)[read] / total[read] for of in (at_m, values))
    at_nodes[read] = means + np.gradient(means, centres_m) * (nodes[read] - centres_m)
    return at_nodes
