"""What the motions of a recording can resolve."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import minimum_filter1d

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene

    Array = NDArray[np.float64]

REVERSAL_S = 4e-3
"""The filters spread a reversal over about so long."""
SLOWEST = 0.2
"""Of the reversals: the slowest ones resolve most."""


SETTLED_S = 0.03
"""What a filter of 60 Hz remembers."""


def settled_way_m(scene: Scene) -> Array:
    """Way since the last reversal or rest (n,), as the filters see it; 0 where they see that still."""
    m = scene.motion
    way_m = np.where(m.moving, np.minimum(m.since_reversal_m, m.since_rest_m), 0.0)
    length = max(round(SETTLED_S / scene.period_s), 1)
    found: Array = minimum_filter1d(way_m, length + 1, origin=length // 2)
    return found


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
