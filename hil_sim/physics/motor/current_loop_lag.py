"""Lag of the current loop: the force follows the reported current as a first-order lag.

Law: tau di'/dt = i - i', solved exactly over a step of constant i.
Source: mismatch catalogue, entry current_loop_lag (first order, 0.2-8 ms); a closed current loop of bandwidth
    1 / tau, see plant/amplifier.
Symbols: i commanded current, which the amplifier reports, A; i' current that makes force A; tau `time_s` s.
Valid: an amplifier that reports its set point, or a current measured ahead of eddy currents in solid iron.
    The lag of a modelled winding is in the reported current already.
Confused with: transport_delay -> residual in proportion to the force's slope here, to its jumps there: a jump
    of current is followed at once, and slowly; a delay answers late, and sharply.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.CURRENT_PATH
ORDER = 3  # the loop that follows it


class Params(NamedTuple):
    """The time constant."""

    time_s: Annotated[float, Quantity("s", 0.0, 0.1, "time constant tau", "ms")]


class State(NamedTuple):
    """Its memory."""

    lagged_a: float = 0.0


NEUTRAL = Params(time_s=0.0)


@kernel
def passed_a(p: Any, s: Any, current: float, _back_emf_v: float, dt_s: float) -> float:
    """Current (A) that makes force after `dt_s` (s) at constant `current`."""
    s.lagged_a = current + (s.lagged_a - current) * math.exp(-dt_s / p.time_s)
    return float(s.lagged_a)
