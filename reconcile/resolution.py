"""What the motions of a recording can resolve."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from reconcile.catalogue.kinds import Scene

REVERSAL_S = 4e-3
"""The filters spread a reversal over about so long."""
SLOWEST = 0.2
"""Of the reversals: the slowest ones resolve most."""


def reversal_way_m(scenes: Sequence[Scene]) -> float:
    """Way that is over before the filters have seen a reversal: over less, friction is a step."""
    ways_m = []
    for scene in scenes:
        m = scene.motion
        turns = np.flatnonzero(np.diff(m.last_direction) != 0.0)
        later = turns + max(round(REVERSAL_S / scene.period_s), 1)
        seen = later < len(m.position_m)
        ways_m.append(np.abs(m.position_m[later[seen]] - m.position_m[turns[seen]]))
    everything = np.concatenate(ways_m) if ways_m else np.zeros(0)
    return float(np.quantile(everything, SLOWEST)) if len(everything) else 0.0
