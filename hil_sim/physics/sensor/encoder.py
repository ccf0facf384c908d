"""Motor encoder: counts per turn, incremental from power-up, one index pulse a turn.

Law: n = floor(x / q + 1/2) - n0, q = lead / counts_per_rev.
Source: a uniform quantiser (Widrow 1956); Wang et al. 2014, theta P / (2 pi), for the encoder side of the
    table.
Symbols: n counts; x motor position m (angle times lead / 2 pi); q `resolution_m` m per count; n0 count at
    power-up; `index_m` position of an index pulse m, repeated every lead.
Valid: ideal graduation. An eccentric disc (once a turn) and interpolation errors are separate effects.
Confused with: low-speed stick-slip, which also moves in steps -> the steps of an encoder are one count.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.SENSOR


class Params(NamedTuple):
    """Resolution on the screw side, and position of the index."""

    resolution_m: Annotated[float, Quantity("m", 1e-12, 1e-2, "travel per count q", "um")]
    index_m: Annotated[float, Quantity("m", -10.0, 10.0, "position of an index pulse", "mm")]


NEUTRAL = None
"""No values remove the quantisation; a conformance test bounds its error to half a count."""


@kernel
def counts(p: Any, position_m: float) -> int:
    """Return the nearest count from the machine's zero at a motor position (m), halves upwards."""
    count: int = math.floor(position_m / p.resolution_m + 0.5)
    return count
