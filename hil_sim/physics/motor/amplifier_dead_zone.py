"""Dead zone of the amplifier: no force below a threshold of the commanded current.

Law: i' = 0 for |i| < it, else i - it sgn(i).
Source: mismatch catalogue, entry amplifier_dead_zone; the dead-zone element of control theory; crossover of a
    linear output stage, dead time of a switched stage without current control.
Symbols: i commanded current, which the amplifier reports, A; i' force-producing current A; it `threshold_a`
    A.
Valid: amplifiers without current measurement around zero.
Confused with: coulomb_friction, also a lost force -> cross zero force while moving: the dead zone steps at
    zero force, friction at zero speed.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.CURRENT_PATH
ORDER = 1  # the output stage


class Params(NamedTuple):
    """The threshold."""

    threshold_a: Annotated[float, Quantity("A", 0.0, 1e3, "threshold it")]


NEUTRAL = Params(threshold_a=0.0)


@kernel
def force_producing_a(p: Any, current: float, _back_emf_v: float, _dt_s: float) -> float:
    """Return the force-producing current (A)."""
    if abs(current) <= p.threshold_a:
        return 0.0
    return float(current - math.copysign(p.threshold_a, current))
