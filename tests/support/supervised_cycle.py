"""One cycle of supervision as the compiled cycle does it: signs of the tick first, then the finding."""

from typing import NamedTuple

import numpy as np

from servo_ctrl.control.signs import SupervisionLimits, signs
from servo_ctrl.cyclic import supervision


class Counts(NamedTuple):
    """Cycles with the current at its limit, and the last cycles in which the axis was pushed."""

    saturated: int
    pushed: tuple[tuple[float, float], ...]
    """Velocity and absolute error, oldest first."""


AT_REST = Counts(0, ())


def supervise(
    limits: SupervisionLimits,
    counts: Counts,
    deviation_m: float,
    force_n: float,
    current_a: float,
    push_n: float,
    velocity_m_s: float,
    error_m: float,
) -> tuple[Counts, int]:
    """Return counts and finding after this cycle."""
    cycles, pushed = limits.runaway_cycles + 1, len(counts.pushed)
    first = 1 % cycles  # anywhere: it is a ring
    kept = np.zeros((cycles, 2))
    for place, cycle in enumerate(counts.pushed):
        kept[(first + place) % cycles] = cycle
    seen = signs(limits, deviation_m, force_n, current_a, push_n, error_m)
    before = supervision.Counts(counts.saturated, pushed, (first + pushed) % cycles)
    after, finding = supervision.supervise(limits, before, kept, seen, push_n, velocity_m_s, error_m)
    oldest = after.next - after.pushed
    ring = tuple(tuple(kept[(oldest + place) % cycles].tolist()) for place in range(after.pushed))
    return Counts(after.saturated, ring), finding
