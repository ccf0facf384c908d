"""Input shaping: adds delayed copies of the set points, which cancel the oscillation that each excites.

    ZV:  impulses 1, K at 0, T/2;  ZVD:  1, 2 K, K^2 at 0, T/2, T;  each over their sum
    K = exp(-zeta pi / sqrt(1 - zeta^2)),  T = 1 / (f sqrt(1 - zeta^2))

Source: Singer and Seering (1990), Preshaping Command Inputs to Reduce System Vibration. ZV cancels the
oscillation at f; ZVD also reduces it strongly at 10 % error of f, with twice the delay. An impulse between
two samples is divided between them. The amplitudes are positive with the sum 1, so that shaped set points
respect every limit that the set points respect. All axes of a path need the same shaper, because different
delays bend the path.
"""

import math
from collections import deque
from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from kernels.arrays import Array

ShaperKind = Literal["zv", "zvd"]
SHAPED_FIELDS = 3
"""Shaped fields of a row: position, velocity, acceleration; the force offset passes unchanged."""


class Taps(NamedTuple):
    """Delays of the copies in samples, ascending and above 0, and their shares."""

    delays: tuple[int, ...]
    shares: tuple[float, ...]

    @property
    def longest(self) -> int:
        """Longest delay in samples."""
        return self.delays[-1] if self.delays else 0


def impulses(kind: ShaperKind, frequency_hz: float, damping_ratio: float) -> tuple[list[float], list[float]]:
    """Return times (s) and shares of the impulses."""
    damped = math.sqrt(1.0 - damping_ratio**2)
    half_s = 0.5 / (frequency_hz * damped)
    k = math.exp(-damping_ratio * math.pi / damped)
    weights = [1.0, k] if kind == "zv" else [1.0, 2.0 * k, k * k]
    return [half_s * index for index in range(len(weights))], [weight / sum(weights) for weight in weights]


def taps(kind: ShaperKind, frequency_hz: float, damping_ratio: float, period_s: float) -> Taps:
    """Return the shaper at the SYNC period."""
    share_of: dict[int, float] = {}
    for time_s, share in zip(*impulses(kind, frequency_hz, damping_ratio), strict=True):
        whole = math.floor(time_s / period_s + 1e-9)
        part = max(time_s / period_s - whole, 0.0)
        share_of[whole] = share_of.get(whole, 0.0) + share * (1.0 - part)
        if part > 1e-9:
            share_of[whole + 1] = share_of.get(whole + 1, 0.0) + share * part
    delays = tuple(delay for delay in sorted(share_of) if delay > 0)
    return Taps(delays, tuple(share_of[delay] for delay in delays))


def shaped(values: Array, shaper: Taps) -> Array:
    """Shape set points (n, fields) of one axis, which rests at the first one before it.

    At rest the shaped set points equal the set points to the bit.
    """
    out = np.array(values, dtype=np.float64)
    fields = slice(0, SHAPED_FIELDS)
    rest = np.zeros_like(values[:1])
    rest[0, 0] = values[0, 0]
    before = np.concatenate((np.repeat(rest, shaper.longest, axis=0), values))
    for delay, share in zip(shaper.delays, shaper.shares, strict=True):
        first = shaper.longest - delay
        out[:, fields] += share * (before[first : first + len(values), fields] - values[:, fields])
    return out


class RowShaper:
    """Shapes the row of each cycle, for all axes; equal to `shaped`."""

    def __init__(self, shapers: Sequence[Taps | None], fields: int) -> None:
        self._shapers = [(index, one) for index, one in enumerate(shapers) if one is not None and one.delays]
        self._fields = fields
        self._longest = max((one.longest for _, one in self._shapers), default=0)
        self._rows: deque[list[float]] = deque(maxlen=self._longest + 1)
        self._still = 0

    @property
    def over(self) -> bool:
        """Whether all set points have passed the shaper."""
        return self._still >= self._longest

    def forget(self) -> None:
        """Start again from rest, because the axes are taken over again."""
        self._rows.clear()
        self._still = self._longest

    def rest_at(self, row: list[float]) -> None:
        """Start from rest at this row."""
        self._rows.extend([row] * self._longest)

    def shape(self, row: list[float]) -> list[float]:
        """Take a row; return the shaped row."""
        if not self._shapers:
            return row
        if not self._rows:
            self.rest_at([value if place % self._fields == 0 else 0.0 for place, value in enumerate(row)])
        self._rows.append(row)
        moves = any(row[1 :: self._fields]) or row[:: self._fields] != self._rows[-2][:: self._fields]
        self._still = 0 if moves else self._still + 1
        out = list(row)
        for index, one in self._shapers:
            for field in range(index * self._fields, index * self._fields + SHAPED_FIELDS):
                value = row[field]
                for delay, share in zip(one.delays, one.shares, strict=True):
                    out[field] += share * (self._rows[-1 - delay][field] - value)
        return out
