"""Lag of the current loop: the force follows the reported current as a first-order lag.

Law: tau di'/dt = i - i', solved exactly over a step of constant i.
Source: mismatch catalogue, entry current_loop_lag (first order, 0.2-8 ms); a closed current loop of bandwidth
    1 / tau, see plant/amplifier.
Symbols: i commanded current, which the amplifier reports, A; i' force-producing current A; tau `time_s` s.
Valid: an amplifier that reports its set point, or a current measured before eddy currents in solid iron.
    The reported current already contains the lag of a modelled winding.
Confused with: transport_delay -> apply a step of the current: a lag responds at once but slowly, a delay late
    but abruptly.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.CURRENT_PATH
ORDER = 3  # the current loop, after the voltage limit


class Params(NamedTuple):
    """The time constant."""

    time_s: Annotated[float, Quantity("s", 0.0, 0.1, "time constant tau", "ms")]


class State(NamedTuple):
    """The lagged current (A)."""

    lagged_a: float = 0.0


NEUTRAL = Params(time_s=0.0)


@kernel
def force_producing_a(p: Any, s: Any, current: float, _back_emf_v: float, dt_s: float) -> float:
    """Return the force-producing current (A) after `dt_s` (s) at constant `current`."""
    s.lagged_a = current + (s.lagged_a - current) * math.exp(-dt_s / p.time_s)
    return float(s.lagged_a)
