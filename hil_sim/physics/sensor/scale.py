"""Grating scale on the table: counts of one resolution step, and a reference mark.

Law: n = floor(x / q + 1/2) - n0.
Source: a uniform quantiser (Widrow 1956); the role of the scale: Feng et al. 2015, section 2 (position
    feedback), and Wang et al. 2014 (0.5 um).
Symbols: n counts; x table position m; q `resolution_m` m per count; n0 count at power-up;
    `reference_mark_m` position of the reference mark m.
Valid: ideal grating. `scale_cyclic_error` models periodic errors of the grating.
Confused with: backlash of one step -> a scale's step is equal at any force and speed.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.SENSOR


class Params(NamedTuple):
    """Resolution, and position of the reference mark."""

    resolution_m: Annotated[float, Quantity("m", 1e-12, 1e-2, "travel per count q", "um")]
    reference_mark_m: Annotated[float, Quantity("m", -10.0, 10.0, "position of the reference mark", "mm")]


NEUTRAL = None
"""No values remove the quantisation; a conformance test bounds its error to half a count."""


@kernel
def counts(p: Any, position_m: float) -> int:
    """Return the nearest count from the machine's zero at a table position (m), halves upwards."""
    count: int = math.floor(position_m / p.resolution_m + 0.5)
    return count
