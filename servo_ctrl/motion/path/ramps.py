"""Look-ahead: computes the fastest speed over the length within the bounds of the zones, smoothed in time.

A backward and a forward pass give v1, a speed whose acceleration jumps. The axes follow its moving mean over
the time tau, so that the jerk is at most a / tau. The mean respects the bounds of the zones because

- each zone is widened by v tau / 2 on both sides, where v is its speed: passing it takes at least tau,
and while the mean is in the zone its whole window lies in the widened zone;
- v1 is constant for tau at each peak (shorter peaks are cut) and, by the widening, in each valley, so that
no window contains both +a and -a.

A rise is a seven-phase S curve; with tau = A / J, (V / J)^(1/2) or (L / 2J)^(1/3) a straight
move from rest to rest is time-optimal.
"""

import numpy as np

from kernels.arrays import Array, Index
from kernels.jit import kernel


def speed_over_length(
    start_m: Array, end_m: Array, speed_m_s: Array, acceleration_m_s2: Array, tau_s: float
) -> tuple[Array, Array]:
    """Return the nodes of v1 over the zones (n,), from rest to rest: lengths and speeds (m,).

    The square of the speed is linear between them.
    """
    widening_m = 0.5 * tau_s * speed_m_s
    first_m, last_m = np.maximum(start_m - widening_m, start_m[0]), np.minimum(end_m + widening_m, end_m[-1])
    edge_m = np.unique(np.concatenate((first_m, last_m)))
    first, last = np.searchsorted(edge_m, first_m), np.searchsorted(edge_m, last_m)
    pieces = len(edge_m) - 1
    top = _lowest(first, last, speed_m_s, np.argsort(speed_m_s), pieces)
    slope = 2.0 * _lowest(first, last, acceleration_m_s2, np.argsort(acceleration_m_s2), pieces)
    length_m, square = _cut_short_peaks(*_look_ahead(edge_m, top**2, slope), tau_s)
    return length_m, np.sqrt(square)


def duration_s(length_m: Array, speed_m_s: Array, tau_s: float) -> float:
    """Return the duration of the smoothed motion, seconds."""
    return float((2.0 * np.diff(length_m) / (speed_m_s[1:] + speed_m_s[:-1])).sum()) + tau_s


def over_time(length_m: Array, speed_m_s: Array, tau_s: float) -> tuple[Array, Array, Array, Array]:
    """Return knots (k,) of the smoothed motion: time, length, speed, acceleration (linear between)."""
    steps_s = 2.0 * np.diff(length_m) / (speed_m_s[1:] + speed_m_s[:-1])
    node_s = np.concatenate(([0.0], np.cumsum(steps_s)))
    time_s = np.unique(np.concatenate((node_s, node_s + tau_s)))
    entering = np.interp(time_s, node_s, speed_m_s)
    leaving = np.interp(time_s - tau_s, node_s, speed_m_s)
    acceleration = (entering - leaving) / tau_s
    step_s = np.diff(time_s)
    # cumulative sums, so that each column is the exact integral of the next
    speed = _summed(0.5 * (acceleration[1:] + acceleration[:-1]) * step_s)
    step_m = (speed[:-1] + (acceleration[:-1] / 3.0 + acceleration[1:] / 6.0) * step_s) * step_s
    return time_s, length_m[0] + _summed(step_m), speed, acceleration


def _summed(steps: Array) -> Array:
    return np.concatenate(([0.0], np.cumsum(steps)))


@kernel
def _lowest(first: Index, last: Index, value: Array, rising: Index, pieces: int) -> Array:
    """Return the lowest value of the zones over each piece; zone z covers first[z] to last[z] - 1.

    `rising` (zones,): the zones, lowest value first.
    """
    low = np.empty(pieces)
    after = np.empty(pieces + 1, np.int64)  # union-find: the next piece without a value
    for piece in range(pieces + 1):
        after[piece] = piece
    for zone in rising:
        piece = first[zone]
        while True:
            found = piece
            while after[found] != found:
                after[found] = after[after[found]]
                found = after[found]
            if found >= last[zone]:
                break
            low[found] = value[zone]
            after[found] = found + 1
            piece = found + 1
    return low


@kernel
def _look_ahead(edge_m: Array, top: Array, slope: Array) -> tuple[Array, Array]:
    """Return nodes (length, squared speed) from rest to rest, within `top` and `slope` of each piece."""
    pieces = len(top)
    at_edge = np.zeros(pieces + 1)
    for k in range(1, pieces):
        at_edge[k] = min(top[k - 1], top[k], at_edge[k - 1] + slope[k - 1] * (edge_m[k] - edge_m[k - 1]))
    for k in range(pieces - 1, 0, -1):
        at_edge[k] = min(at_edge[k], at_edge[k + 1] + slope[k] * (edge_m[k + 1] - edge_m[k]))
    length_m, square = np.empty(3 * pieces + 1), np.empty(3 * pieces + 1)
    length_m[0], square[0], nodes = edge_m[0], 0.0, 1
    for k in range(pieces):
        start, end, piece_m = at_edge[k], at_edge[k + 1], edge_m[k + 1] - edge_m[k]
        highest = min(top[k], 0.5 * (start + end + slope[k] * piece_m))
        up_m = min(max(highest - start, 0.0) / slope[k], piece_m)
        down_m = min(max(highest - end, 0.0) / slope[k], piece_m - up_m)
        for at_m, level in (
            (edge_m[k] + up_m, highest),
            (edge_m[k + 1] - down_m, highest),
            (edge_m[k + 1], end),
        ):
            if at_m > length_m[nodes - 1]:
                length_m[nodes], square[nodes] = at_m, level
                nodes += 1
        square[nodes - 1] = end
    return length_m[:nodes], square[:nodes]


@kernel
def _cut_short_peaks(length_m: Array, square: Array, tau_s: float) -> tuple[Array, Array]:
    """Lower every peak shorter than tau to the level that lasts tau."""
    count = len(length_m)
    x, y = np.empty(3 * count), np.empty(3 * count)
    x[0], y[0], top = length_m[0], square[0], 0
    i = 1
    while i < count:
        right_m, right = length_m[i], square[i]
        if right >= y[top]:
            top += 1
            x[top], y[top] = right_m, right
            i += 1
            continue
        # the speed falls from here: lower the peak before it if that is too short
        left = top
        while left > 0 and y[left - 1] == y[top]:
            left -= 1
        level, flat_m = y[top], x[top] - x[left]
        if left == 0 or y[left - 1] > level or flat_m >= np.sqrt(level) * tau_s:
            top += 1
            x[top], y[top] = right_m, right
            i += 1
            continue
        below = max(y[left - 1], right)
        rising = (x[left] - x[left - 1]) / (level - y[left - 1])
        falling = (right_m - x[top]) / (level - right)
        spread = rising + falling
        if flat_m + spread * (level - below) >= np.sqrt(below) * tau_s:
            whole_m = flat_m + spread * level
            speed = 2.0 * whole_m / (tau_s + np.sqrt(tau_s**2 + 4.0 * spread * whole_m))
            lower = max(min(speed**2, level), below)
        else:
            lower = below
        from_m = x[left] - rising * (level - lower)
        to_m = x[top] + falling * (level - lower)
        if lower == y[left - 1]:
            top = left - 1
        else:
            top = left
            x[top], y[top] = max(from_m, x[left - 1]), lower
        if lower == right:
            to_m = right_m
            i += 1
        top += 1
        x[top], y[top] = min(to_m, right_m), lower
        if lower > below and i < count:
            top += 1
            x[top], y[top] = right_m, right
            i += 1
    return x[: top + 1], y[: top + 1]
